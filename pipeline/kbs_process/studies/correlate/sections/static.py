"""Raw measured wrench next to the computed static one: gravity, before it is taken away."""

from __future__ import annotations

from kbs_process.report import histories, series
from kbs_process.report.panel import Block, Figure, Live, Panel, Picture, Text
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Table, Tables
from kbs_process.report.text import count
from kbs_process.studies.correlate.choose import PLATES, by_role
from kbs_process.studies.correlate.results import Results

_SAYS = Prose("kbs_process.studies.correlate", "static")


def panel(results: Results, tables: Tables) -> Panel:
    """Interactive view of all recordings, and plates of the first few for paper."""
    found = [
        (recording, table)
        for recording in by_role(results.recordings)
        if (table := tables.gravity(recording.name)) is not None and table.channels
    ]
    question = "Does the computed gravity account for what the transducer reads?"
    if not found:
        return Panel("static", "Static wrench", question, (Text("No recording has a gravity table."),))
    scenes = [_scene(recording.name, table) for recording, table in found]
    pictures = tuple(_plate(recording.name, recording.role, table) for recording, table in found[:PLATES])
    figure = Figure(
        "Measured and static wrench at the transducer (frame T), unfiltered",
        pictures,
        _SAYS.caption("histories"),
        Live("static", ("measured", "static", "residual"), series.views(scenes), two_scales=True),
    )
    blocks: list[Block] = [figure]
    if len(found) > PLATES:
        blocks.append(
            Text(f"On paper: {PLATES} of {count(len(found), 'recording')}; all of them in the page.", tone="muted")
        )
    return Panel("static", "Static wrench", question, tuple(blocks))


def _scene(name: str, table: Table) -> series.Scene:
    traces = tuple(
        series.Trace(
            channel,
            table.unit(channel),
            table.columns[f"{channel}.measured"],
            table.columns.get(f"{channel}.static"),
            table.columns.get(f"{channel}.residual"),
        )
        for channel in table.channels
    )
    return series.Scene(name, "unfiltered, transducer (T)", table.columns["t"], table.valid, traces)


def _plate(name: str, role: str, table: Table) -> Picture:
    return histories.strips(
        table.columns["t"],
        _scene(name, table).traces,
        series.stretches(table.columns["t"], ~table.valid),
        computed_name="static",
        same_scale=False,
        alt=f"{name}: measured and static wrench with their difference, channels {', '.join(table.channels)}",
        title=f"{name} ({role})",
    )
