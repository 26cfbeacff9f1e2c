"""Figures of merit: how well the prediction describes the measurement, and on which side it errs."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby, zip_longest

import numpy as np

from kbs_process.report import draw
from kbs_process.report.panel import Block, Cell, Figure, Fold, Grid, Panel, Picture, Text
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Tables
from kbs_process.report.text import frame_label, label, measure, number, percent, unit
from kbs_process.studies.correlate.choose import (
    ROLES,
    band_label,
    band_names,
    folded,
    main_band,
    main_frame,
    pessimistic,
)
from kbs_process.studies.correlate.results import Merit, Results

_SAYS = Prose("kbs_process.studies.correlate", "merit")
_MARKS = ("o", "s", "^", "D", "v", "P", "X", "*")


_HEAD = (
    "Recording", "Channel", "Measured rms", "Predicted rms", "Residual rms", "Measured peak", "Predicted peak",
    "Correlation", "FVE", "Spectral ratio", "Pessimism",
)  # fmt: skip


def panel(results: Results, tables: Tables) -> Panel:
    """Table and figure for the requirement's band and frame; all others on demand."""
    question = "How well does the prediction describe the measurement, and is it pessimistic?"
    main = (main_band(results), main_frame(results))
    ordered = sorted(results.merit, key=lambda row: (_rank(results, row, main), ROLES.index(row.role)))
    groups = {key: tuple(rows) for key, rows in groupby(ordered, key=lambda row: (row.band, row.frame))}
    if not groups:
        return Panel("merit", "Figures of merit", question, (Text("There is no prediction to judge."),))
    key, *others = groups
    blocks: list[Block] = [_pessimistic(results), *folded(_table(results, *key, groups[key]), "Further rows")]
    drawn = [row for row in groups[key] if row.measured_peak and row.predicted_peak]
    if drawn:
        title = f"Peaks, {band_label(results, key[0])}, {frame_label(key[1])}"
        alt = f"Predicted against measured peak of {len(drawn)} recordings and channels"
        blocks.append(Figure(title, (_peaks(drawn, alt),), _SAYS.caption("peaks")))
    if others:
        tables_of_others = tuple(_table(results, *other, groups[other]) for other in others)
        blocks.append(Fold("Other bands and frames", tables_of_others))
    return Panel("merit", "Figures of merit", question, tuple(blocks))


def _pessimistic(results: Results) -> Grid:
    """On which channels the predicted peak is no less than the measured one, wherever that is above the noise."""
    channels = list(dict.fromkeys(row.channel for row in results.merit))
    every = dict.fromkeys((row.band, row.frame) for row in results.merit)
    ordered = sorted(every, key=lambda key: band_names(results).index(key[0]))
    rows: list[tuple[str | Cell, ...]] = [
        (
            f"{band_label(results, band)}, {frame_label(frame)}",
            *(
                pessimistic(
                    [row for row in results.merit if (row.band, row.frame, row.channel) == (band, frame, channel)]
                )
                for channel in channels
            ),
        )
        for band, frame in ordered
    ]
    head = ("Is the prediction pessimistic?", *map(label, channels))
    return Grid("Pessimism by channel", head, tuple(rows), "l" + "c" * len(channels), _SAYS("pessimistic_note"))


def _rank(results: Results, row: Merit, main: tuple[str, str]) -> tuple[bool, int, str]:
    """Order groups: the main one, then by band, then by frame."""
    names = band_names(results)
    place = names.index(row.band) if row.band in names else len(names)
    return ((row.band, row.frame) != main, place, row.frame)


def _table(results: Results, band: str, frame: str, rows: tuple[Merit, ...]) -> Grid:
    title = f"Figures of merit, {band_label(results, band)}, {frame_label(frame)}"
    return Grid(title, _HEAD, _rows(rows), "kkrrrrrrrrr", _SAYS("table_note"))


def _rows(rows: tuple[Merit, ...]) -> tuple[tuple[str | Cell, ...], ...]:
    """Name a recording in the first of its rows, and its role in the second."""
    body: list[tuple[str | Cell, ...]] = []
    for (recording, role), own in groupby(rows, key=lambda row: (row.recording, row.role)):
        figures = list(map(_figures, own))
        names = [recording, Cell(role, "muted")] if len(figures) > 1 else [f"{recording} ({role})"]
        body += [(name, *row) for name, row in zip_longest(names, figures, fillvalue="")]
    return tuple(body)


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
    )


def _peaks(rows: Sequence[Merit], alt: str) -> Picture:
    """Draw one mark a recording and channel, hollow where it is at the noise, axes for each unit."""
    units = list(dict.fromkeys(row.unit for row in rows))
    channels = list(dict.fromkeys(row.channel for row in rows))
    with draw.style():
        figure, axes = draw.row(3.1, len(units), width=draw.WIDTH if len(units) > 1 else 4.2)
        for axis, name in zip(axes, units, strict=True):
            shown = [row for row in rows if row.unit == name]
            measured = np.array([row.measured_peak for row in shown], dtype=float)
            predicted = np.array([row.predicted_peak for row in shown], dtype=float)
            low = 0.3 * float(min(measured.min(), predicted.min()))
            high = 1.6 * float(max(measured.max(), predicted.max()))
            axis.fill_between([low, high], [low, high], [high, high], color="#f4efe6", linewidth=0)
            axis.plot([low, high], [low, high], color=draw.RESIDUAL, linewidth=0.8)
            axis.text(0.03, 0.96, "pessimistic", transform=axis.transAxes, va="top", color="#8a6d3b")
            axis.text(0.97, 0.04, "optimistic", transform=axis.transAxes, ha="right", color=draw.LIMIT)
            for channel, noise in dict.fromkeys((row.channel, row.at_the_noise) for row in shown):
                mine = np.array([(row.channel, row.at_the_noise) == (channel, noise) for row in shown])
                index = channels.index(channel)
                color = draw.SERIES[index % len(draw.SERIES)]
                axis.plot(
                    measured[mine],
                    predicted[mine],
                    linestyle="none",
                    marker=_MARKS[index % len(_MARKS)],
                    markersize=4.5,
                    markerfacecolor="white" if noise else color,
                    markeredgecolor=draw.RESIDUAL if noise else color,
                    markeredgewidth=0.7,
                    label=f"{label(channel)}, at the noise" if noise else label(channel),
                )
            draw.logarithmic(axis, "x", low, high)
            draw.logarithmic(axis, "y", low, high)
            axis.set_xlabel(f"measured peak / {unit(name)}")
            axis.set_ylabel(f"predicted peak / {unit(name)}")
            axis.legend(loc="center left", bbox_to_anchor=(0.0, 0.62), fontsize=6.5)
        return draw.picture(figure, alt)
