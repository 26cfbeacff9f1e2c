"""The budget's table says what was measured, to hold each stage against."""

from __future__ import annotations

from pathlib import Path

import msgspec

from kbs_process.report.panel import Grid, Panel
from kbs_process.report.tables import Tables
from kbs_process.studies.correlate.results import Results
from kbs_process.studies.correlate.sections.budget import panel
from report import sample


def grids(panel: Panel) -> list[Grid]:
    """All tables, those that are folded too."""
    nested = [getattr(block, "blocks", (block,)) for block in panel.blocks]
    return [block for group in nested for block in group if isinstance(block, Grid) and "uncertaint" in block.title]


def last_rows(found: Results) -> list[tuple[object, ...]]:
    return [grid.rows[-1] for grid in grids(panel(found, Tables(Path("nowhere"))))]


def test_the_measured_rms_stands_below_the_total() -> None:
    found = sample.command_results()
    one = found.budget[0]
    row = msgspec.structs.replace(
        next(merit for merit in found.merit if merit.channel == one.channel),
        recording=one.recording, band=one.band, frame=one.frame, measured_rms=0.0421,
    )  # fmt: skip
    told = last_rows(msgspec.structs.replace(found, budget=(one,), merit=(row,)))
    assert told == [("Measured", "rms, to compare with", "0.042")]


def test_without_a_figure_of_merit_the_total_is_last() -> None:
    found = sample.command_results()
    assert [row[0] for row in last_rows(msgspec.structs.replace(found, budget=found.budget[:1], merit=()))] == ["Total"]
