"""Fitted numbers that differ between results."""

from __future__ import annotations

from kbs_process.report.panel import Block, Cell, Fold, Grid, Panel, Text
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Tables
from kbs_process.report.text import MISSING, measure, number, unit
from kbs_process.studies.compare.results import FAR, ComparisonResults, Number

_SAYS = Prose("kbs_process.studies.compare", "sections")


def panel(results: ComparisonResults, tables: Tables) -> Panel:
    """Those that differ first; all others on demand."""
    head = ("Number", "Unit", *(one.mark for one in results.compared), "Apart / sigma")

    def grid(title: str, chosen: list[Number]) -> Grid:
        return Grid(title, head, tuple(map(_row, chosen)), "lk" + "r" * (len(head) - 2), _SAYS("numbers_note"))

    apart = [one for one in results.numbers if one.distance is not None and one.distance > FAR]
    others = [one for one in results.numbers if one not in apart]
    blocks: list[Block] = [grid("Numbers that differ", apart)] if apart else [Text(_SAYS("numbers_alike", far=FAR))]
    if others:
        blocks.append(Fold("Numbers that agree", (grid("Numbers that agree", others),)))
    return Panel("numbers", "Fitted numbers", "Is it still the same rig, by what gravity shows of it?", tuple(blocks))


def _row(one: Number) -> tuple[str | Cell, ...]:
    values = (measure(value, sigma) for value, sigma in zip(one.value, one.sigma, strict=True))
    far = one.distance is not None and one.distance > FAR
    told = MISSING if one.distance is None else number(one.distance, 2)
    return (one.name, unit(one.unit), *values, Cell(told, "undecided" if far else ""))
