"""Each requirement's value over the results: a trend."""

from __future__ import annotations

import numpy as np

from kbs_process.report import draw
from kbs_process.report.panel import Block, Cell, Figure, Grid, Panel, Picture, Text
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Tables
from kbs_process.report.text import MISSING, band_hz, exact, frame_label, number, unit
from kbs_process.studies.compare import axis as along
from kbs_process.studies.compare.results import ComparisonResults, Judged

_SAYS = Prose("kbs_process.studies.compare", "sections")


def panel(results: ComparisonResults, tables: Tables) -> Panel:
    """One figure and one table a requirement."""
    names = [f"{one.mark} {one.name}" for one in results.compared]
    blocks: list[Block] = []
    for one in results.requirements:
        title = f"{one.name}, {band_hz(*one.band_Hz)}, {frame_label(one.frame)}"
        blocks += [Figure(title, (_trend(one, results),), _SAYS.caption("trend")), _table(one, names, title)]
    question = "How does what was measured compare with the limit, and with the other results?"
    return Panel("requirements", "Requirements", question, tuple(blocks) or (Text("No results judge a requirement."),))


def _table(one: Judged, names: list[str], title: str) -> Grid:
    each = zip(
        names, one.verdict, one.value, one.low, one.high, one.predicted, one.residual, one.channel, one.recording,
        strict=True,
    )  # fmt: skip
    rows = tuple(
        (
            name,
            number(value),
            MISSING if low is None or high is None else f"{number(low)} to {number(high)}",
            number(predicted),
            number(residual),
            channel or MISSING,
            recording or MISSING,
            Cell(verdict, verdict) if verdict else MISSING,
        )
        for name, verdict, value, low, high, predicted, residual, channel, recording in each
    )
    symbol = unit(one.unit)
    head = (
        "", f"Measured / {symbol}", f"Interval, 95 % / {symbol}", f"Predicted / {symbol}",
        f"Residual, rms / {symbol}", "Channel", "Recording", "Verdict",
    )  # fmt: skip
    return Grid(title, head, rows, "lrrrrkkk", f"Limit: {exact(one.limit)} {symbol}, of the {one.statistic}.")


def _trend(one: Judged, results: ComparisonResults) -> Picture:
    """Draw measured values with their intervals, predicted ones, and the limit, in the order of the results."""
    place = along.places(results)
    value, low, high, predicted = (
        np.array([np.nan if entry is None else entry for entry in column], dtype=float)
        for column in (one.value, one.low, one.high, one.predicted)
    )
    with draw.style():
        figure, axis = draw.canvas(2.4)
        axis.vlines(place, low, high, color=draw.MEASURED, linewidth=1.0)
        axis.plot(place, value, "o", color=draw.MEASURED, markersize=4, label="measured, 95 % interval")
        axis.plot(place, predicted, "D", color=draw.PREDICTED, markersize=3.5, label="predicted")
        draw.limits(axis, one.limit)
        along.mark(axis, results)
        axis.set_ylim(bottom=0.0)
        axis.set_ylabel(f"{one.statistic} / {unit(one.unit)}")
        draw.legend_above(figure)
        return draw.picture(figure, f"{one.name}: measured and predicted {one.statistic} of {len(place)} results")
