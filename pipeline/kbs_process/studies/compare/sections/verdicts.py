"""What was compared, and each verdict."""

from __future__ import annotations

from kbs_process.report.panel import Cell, Grid, Panel, Tone
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Tables
from kbs_process.report.text import MISSING, number
from kbs_process.results.records import Status
from kbs_process.studies.compare.results import Compared, ComparisonResults

_SAYS = Prose("kbs_process.studies.compare", "sections")
_TONES: dict[Status, Tone] = {"pass": "pass", "fail": "fail", "undecided": "undecided", "none": "muted"}


def panel(results: ComparisonResults, tables: Tables) -> Panel:
    """One row a folder of results."""
    head = ("", "Campaign", "Date of test", "Document", "Requirements", "Model", "Chi-square", "Made by", "Folder")
    rows = tuple(map(_row, results.compared))
    grid = Grid("What is compared", head, rows, "kkklkkrll", _SAYS("verdicts_note"))
    return Panel("verdicts", "Verdicts", "What is compared, and what was the answer each time?", (grid,))


def _row(one: Compared) -> tuple[str | Cell, ...]:
    document = f"{one.number} rev. {one.revision}" if one.revision else one.number
    return (
        one.mark,
        Cell(one.name, to=one.page),
        one.date or MISSING,
        document.strip() or MISSING,
        Cell("no verdict" if one.status == "none" else one.status, _TONES[one.status]),
        one.model or MISSING,
        number(one.chi_square, 2),
        one.made_by,
        one.folder,
    )
