"""Raw measured wrench next to the computed static one: gravity, before it is taken away."""

from __future__ import annotations

from kbs_process.report import histories, series
from kbs_process.report.panel import Block, Caption, Figure, Live, Panel, Picture, Text
from kbs_process.report.tables import Table, Tables
from kbs_process.report.text import count
from kbs_process.report.views import Scene, views
from kbs_process.studies.correlate.results import Results
from kbs_process.studies.correlate.sections.choose import by_role

PLATES = 6
_CAPTION = Caption(
    shown="Every channel as measured at the transducer (cross-coupling undone), the static wrench that "
    "the fitted masses and centres of gravity give at the measured angles, and their difference on a "
    "scale of its own. Shaded: samples that were lost or lie within a filter's edge.",
    good="The two curves cannot be told apart on the left; the difference is small against the static "
    "wrench, without slope, and looks like the disturbance sought.",
    bad="A difference that follows the joint angle (wrong CoG, tilt or misalignment), that jumps (an "
    "encoder's converter switches, a loose harness), or that drifts (temperature).",
    do="A slope over angle: see the gravity fit's parameters and checks. A jump: look at the encoder of "
    "that instant. A drift: take the transducer's zero before and after the run.",
)


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
        _CAPTION,
        Live("static", ("measured", "static", "residual"), views(scenes), two_scales=True),
    )
    blocks: list[Block] = [figure]
    if len(found) > PLATES:
        blocks.append(
            Text(f"On paper: {PLATES} of {count(len(found), 'recording')}; all of them in the page.", tone="muted")
        )
    return Panel("static", "Static wrench", question, tuple(blocks))


def _scene(name: str, table: Table) -> Scene:
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
    return Scene(name, "unfiltered, transducer (T)", table.columns["t"], table.valid, traces)


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
