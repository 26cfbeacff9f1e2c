"""Figures of merit: how well the prediction describes the measurement, and on which side it errs."""

from __future__ import annotations

from itertools import groupby

from kbs_process.report.panel import Block, Caption, Cell, Figure, Fold, Grid, Panel, Text
from kbs_process.report.tables import Tables
from kbs_process.report.text import frame_label, measure, number, percent, unit
from kbs_process.studies.correlate.figures import merit
from kbs_process.studies.correlate.results import Merit, Results
from kbs_process.studies.correlate.sections.choose import ROLES, band_label, band_names, folded, main_band, main_frame

_CAPTION = Caption(
    shown="Predicted against measured peak, one mark a recording and channel. On the line they are "
    "equal; above it the prediction is the larger, hence pessimistic. Hollow: at the noise, as the measured rms is "
    "less than twice its uncertainty.",
    good="Marks on the line or a little above it; repeats of a trajectory close together.",
    bad="Marks below the line: the prediction promises less disturbance than there is. Marks far above "
    "it: the margin is spent on the model.",
    do="For a mark below the line, see that channel's time history. A hollow mark says nothing of the "
    "prediction: record more repeats, or look at the unfiltered disturbance, where the signal is larger.",
)
_NOTE = (
    "FVE: fraction of the measured variance that the prediction explains; 100 % is perfect, 0 no better "
    "than no prediction, negative worse. Spectral ratio: predicted over measured power density, geometric mean "
    "over the band's frequencies: a quiet frequency counts as much as a loud one. "
    "Pessimism: predicted over measured peak. At the noise: the measured rms is less than twice its uncertainty, "
    "so that the figures in grey describe the noise and not the prediction."
)
_HEAD = (
    "Recording",
    "Role",
    "Channel",
    "Measured rms",
    "Predicted rms",
    "Residual rms",
    "Measured peak",
    "Predicted peak",
    "Correlation",
    "FVE",
    "Spectral ratio",
    "Pessimism",
    "",
)


def panel(results: Results, tables: Tables) -> Panel:
    """Table and figure for the requirement's band and frame; all others on demand."""
    question = "How well does the prediction describe the measurement, and is it pessimistic?"
    main = (main_band(results), main_frame(results))
    ordered = sorted(results.merit, key=lambda row: (_rank(results, row, main), ROLES.index(row.role)))
    groups = {key: tuple(rows) for key, rows in groupby(ordered, key=lambda row: (row.band, row.frame))}
    if not groups:
        return Panel("merit", "Figures of merit", question, (Text("There is no prediction to judge."),))
    key, *others = groups
    blocks: list[Block] = list(folded(_table(results, *key, groups[key]), "Further rows"))
    drawn = [row for row in groups[key] if row.measured_peak and row.predicted_peak]
    if drawn:
        title = f"Peaks, {band_label(results, key[0])}, {frame_label(key[1])}"
        alt = f"Predicted against measured peak of {len(drawn)} recordings and channels"
        blocks.append(Figure(title, (merit.peaks(drawn, alt),), _CAPTION))
    if others:
        tables_of_others = tuple(_table(results, *other, groups[other]) for other in others)
        blocks.append(Fold("Other bands and frames", tables_of_others))
    return Panel("merit", "Figures of merit", question, tuple(blocks))


def _rank(results: Results, row: Merit, main: tuple[str, str]) -> tuple[bool, int, str]:
    """Order groups: the main one, then by band, then by frame."""
    names = band_names(results)
    place = names.index(row.band) if row.band in names else len(names)
    return ((row.band, row.frame) != main, place, row.frame)


def _table(results: Results, band: str, frame: str, rows: tuple[Merit, ...]) -> Grid:
    title = f"Figures of merit, {band_label(results, band)}, {frame_label(frame)}"
    return Grid(title, _HEAD, _rows(rows), "kkkrrrrrrrrrk", _NOTE)


def _rows(rows: tuple[Merit, ...]) -> tuple[tuple[str | Cell, ...], ...]:
    """Name a recording in the first of its rows only."""
    named = [("", "")] + [(row.recording, row.role) for row in rows]
    return tuple(
        (*(("", "") if name == before else name), *_figures(row))
        for row, name, before in zip(rows, named[1:], named, strict=False)
    )


def _figures(row: Merit) -> tuple[str | Cell, ...]:
    noise = row.at_the_noise
    poor = row.fraction_of_variance is not None and row.fraction_of_variance < 0.0
    optimistic = row.pessimism is not None and row.pessimism < 1.0

    def judged(text: str, *, doubtful: bool = False) -> Cell:
        return Cell(text, "muted" if noise else "undecided" if doubtful else "")

    return (
        f"{row.channel} / {unit(row.unit)}",
        measure(row.measured_rms, row.sigma, 3),
        number(row.predicted_rms),
        number(row.residual_rms),
        number(row.measured_peak),
        number(row.predicted_peak),
        judged(number(row.correlation, 2)),
        judged(percent(row.fraction_of_variance, 2), doubtful=poor),
        judged(number(row.spectral_ratio, 2)),
        judged(number(row.pessimism, 2), doubtful=optimistic),
        Cell("at the noise" if noise else "", "muted"),
    )
