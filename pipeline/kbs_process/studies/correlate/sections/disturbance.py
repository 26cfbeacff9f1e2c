"""Measured disturbance next to the predicted one, band by band, at the transducer and at the spacecraft."""

from __future__ import annotations

from collections.abc import Iterator

from kbs_process.report import histories, series
from kbs_process.report.panel import Block, Figure, Live, Panel, Picture, Text
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Table, Tables
from kbs_process.report.text import frame_label
from kbs_process.results.judged import Frame
from kbs_process.studies.correlate.choose import (
    PLATES,
    band_label,
    band_names,
    by_role,
    main_band,
    main_frame,
    peak_limit,
)
from kbs_process.studies.correlate.results import Results

_SAYS = Prose("kbs_process.studies.correlate", "disturbance")


Entry = tuple[str, str, Frame, Table]  # recording, band, frame, table


def panel(results: Results, tables: Tables) -> Panel:
    """Interactive view of every recording, band and frame; on paper what is required, each band, and the bursts."""
    question = "Does the predicted disturbance look like the measured one, and is it the larger of the two?"
    found = list(_found(results, tables))
    if not found:
        return Panel("disturbance", "Disturbance", question, (Text("No band table to show."),))
    scenes = [_scene(results, *entry) for entry in found]
    main = (main_band(results), main_frame(results))
    bursts = (_whole_band(results), results.campaign.frame)
    filtered = [(band.name, results.campaign.frame) for band in results.bands if band.low_pass_Hz is not None]
    plates = [entry for key in (main, bursts) for entry in _plates(found, key)]
    plates += [entry for key in filtered for entry in _plates(found, key)[:1]]
    live = series.views(scenes)
    shown = {view.choice for view in live}
    shortcuts = {"Requirement" if results.requirements else "Narrowest band": main, "Bursts (unfiltered)": bursts}
    figure = Figure(
        "Disturbance, measured and predicted",
        tuple(_plate(results, *plate) for plate in {entry[:3]: entry for entry in plates}.values()),
        _SAYS.caption("histories"),
        Live(
            "disturbance",
            ("measured", "predicted", "residual"),
            live,
            two_scales=False,
            shortcuts=tuple(
                (name, _choice(results, *key)) for name, key in shortcuts.items() if _choice(results, *key) in shown
            ),
        ),
    )
    blocks: list[Block] = [figure]
    if len(live) < len(scenes):
        left_out = f"{len(scenes) - len(live)} of {len(scenes)} combinations of recording, band and frame"
        blocks.append(Text(f"To keep the page small, {left_out} are in the tables only.", tone="muted"))
    return Panel("disturbance", "Disturbance", question, tuple(blocks))


def _found(results: Results, tables: Tables) -> Iterator[Entry]:
    """Every table with something to compare, in the order of interest: band, frame, recording.

    Calibration recordings serve the fit; they are shown with the static wrench.
    """
    main = main_frame(results)
    compared = [recording for recording in by_role(results.recordings) if recording.role != "calibration"]
    own = results.campaign.frame
    frames: tuple[Frame, Frame] = ("S", own) if main == "S" else (own, "S")
    for band in band_names(results):
        for frame in frames:
            for recording in compared:
                table = tables.band(recording.name, band, frame)
                if table is not None and table.channels:
                    yield recording.name, band, frame, table


def _plates(found: list[Entry], key: tuple[str, str]) -> list[Entry]:
    """Return the first entries in a band and frame."""
    return [entry for entry in found if entry[1:3] == key][:PLATES]


def _whole_band(results: Results) -> str:
    """Return the band that nothing was cut from, or else the main one."""
    uncut = (band.name for band in results.bands if band.low_pass_Hz is None)
    return next(uncut, main_band(results))


def _choice(results: Results, band: str, frame: str) -> str:
    return f"{band_label(results, band)}, {frame_label(frame)}"


def _traces(results: Results, band: str, frame: Frame, table: Table) -> tuple[series.Trace, ...]:
    traces = []
    for channel in table.channels:
        measured = table.columns[f"{channel}.measured"]
        predicted = table.columns.get(f"{channel}.predicted")
        residual = None if predicted is None else measured - predicted
        unit = table.unit(channel)
        limit = peak_limit(results, band, frame, channel, unit)
        traces.append(series.Trace(channel, unit, measured, predicted, residual, limit))
    return tuple(traces)


def _scene(results: Results, name: str, band: str, frame: Frame, table: Table) -> series.Scene:
    traces = _traces(results, band, frame, table)
    return series.Scene(name, _choice(results, band, frame), table.columns["t"], table.valid, traces)


def _plate(results: Results, name: str, band: str, frame: Frame, table: Table) -> Picture:
    title = f"{name}, {_choice(results, band, frame)}"
    return histories.strips(
        table.columns["t"],
        _traces(results, band, frame, table),
        series.stretches(table.columns["t"], ~table.valid),
        computed_name="predicted",
        same_scale=True,
        alt=f"{title}: measured and predicted disturbance with their difference",
        title=title,
    )
