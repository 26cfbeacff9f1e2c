"""Fitted numbers that differ between results."""

from __future__ import annotations

import numpy as np

from kbs_process.report import draw
from kbs_process.report.panel import Block, Cell, Figure, Fold, Grid, Panel, Picture, Text
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Tables
from kbs_process.report.text import MISSING, element, label, measure, number, unit
from kbs_process.studies.compare import axis as along
from kbs_process.studies.compare.results import ComparisonResults, Number, far

_SAYS = Prose("kbs_process.studies.compare", "sections")
_DRAWN = 12  # numbers, those that differ most


def panel(results: ComparisonResults, tables: Tables) -> Panel:
    """Those that differ first; all others on demand."""
    much = far(len(results.compared))
    few = len(results.compared) <= along.FEW
    columns = tuple(one.mark for one in results.compared) if few else ("First", "Last", "Least", "Greatest")
    head = ("Number", "Unit", *columns, "Apart / sigma")

    def grid(title: str, chosen: list[Number]) -> Grid:
        return Grid(
            title,
            head,
            tuple(_row(one, few, much) for one in chosen),
            "lk" + "r" * (len(head) - 2),
            _SAYS("numbers_note"),
        )

    apart = [one for one in results.numbers if one.distance is not None and one.distance > much]
    others = [one for one in results.numbers if one not in apart]
    blocks: list[Block] = [grid("Numbers that differ", apart)] if apart else [Text(_SAYS("numbers_alike", far=much))]
    if drawn := [one for one in results.numbers if one.determined][:_DRAWN]:
        blocks.insert(0, Figure("Fitted numbers", (_trends(drawn, results),), _SAYS.caption("numbers")))
    if others:
        blocks.append(Fold("Numbers that agree", (grid("Numbers that agree", others),)))
    return Panel("numbers", "Fitted numbers", "Does gravity show the same rig each time?", tuple(blocks))


def _trends(drawn: list[Number], results: ComparisonResults) -> Picture:
    """Draw each number with its interval, in the order of the results."""
    place = along.places(results)
    with draw.style():
        columns = min(3, len(drawn))
        rows = -(-len(drawn) // columns)
        figure, axes = draw.grid(1.5 * rows + 0.2, rows, columns)
        for axis, one in zip(axes, drawn, strict=False):
            value, sigma = (np.array(each, dtype=np.float64) for each in (one.value, one.sigma))  # None: NaN
            axis.vlines(place, value - 2.0 * sigma, value + 2.0 * sigma, color=draw.MEASURED, linewidth=1.0)
            axis.plot(place, value, "o", color=draw.MEASURED, markersize=3)
            axis.set_title(f"{label(element(one.name), 34)} / {unit(one.unit)}", fontsize=6)
            along.mark(axis, results)
        for axis in axes[len(drawn) :]:
            axis.set_axis_off()
        return draw.picture(
            figure, f"Fitted numbers of {len(place)} results: {', '.join(element(one.name) for one in drawn)}"
        )


def _row(one: Number, few: bool, much: float) -> tuple[str | Cell, ...]:
    known = [(value, sigma) for value, sigma in zip(one.value, one.sigma, strict=True) if value is not None]
    every = zip(one.value, one.sigma, strict=True) if few else (known[0], known[-1], min(known), max(known))
    values = (measure(value, sigma) for value, sigma in every)
    apart = one.distance or 0.0
    told = MISSING if one.distance is None else number(apart, 2)
    return (element(one.name), unit(one.unit), *values, Cell(told, "undecided" if apart > much else ""))
