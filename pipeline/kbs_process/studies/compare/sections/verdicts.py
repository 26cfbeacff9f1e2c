"""What was compared, and each verdict."""

from __future__ import annotations

from kbs_process.report.panel import Cell, Grid, Panel, Tone
from kbs_process.report.tables import Tables
from kbs_process.report.text import MISSING
from kbs_process.results.records import Status
from kbs_process.studies.compare.results import ComparisonResults

_TONES: dict[Status, Tone] = {"pass": "pass", "fail": "fail", "undecided": "undecided", "none": "muted"}


def panel(results: ComparisonResults, tables: Tables) -> Panel:
    """One row a folder of results."""
    rows = tuple(
        (
            one.mark,
            one.name,
            one.date or MISSING,
            Cell("no verdict" if one.status == "none" else one.status, _TONES[one.status]),
            one.model or MISSING,
            one.made_by,
            one.folder,
        )
        for one in results.compared
    )
    head = ("", "Campaign", "Date of test", "Requirements", "Model", "Made by", "Folder")
    grid = Grid("What is compared", head, rows, "kkkklll")
    return Panel("verdicts", "Verdicts", "What is compared, and what was the answer each time?", (grid,))
