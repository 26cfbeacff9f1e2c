"""How are the pointing errors distributed?"""

from __future__ import annotations

import numpy as np

from kbs_process.report import distributions as pointing
from kbs_process.report import draw, series
from kbs_process.report.panel import Block, Figure, Fold, Panel, Picture
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Table, Tables
from kbs_process.studies.reference_day.results import ReferenceDayResults, Section

_SAYS = Prose("kbs_process.studies.reference_day", "errors")
AXES = (("az", "azimuth", draw.MEASURED), ("el", "elevation", draw.PREDICTED))
_POINTS = 3000  # of a curve over the day


def panel(results: ReferenceDayResults, tables: Tables) -> Panel:
    """Densities of the first section, those of the others on demand, and the histories."""
    blocks: list[Block] = []
    table = tables.read("day", "error")
    if table is not None:
        first, *rest = results.sections
        title = f"Distribution of the pointing error, section {first.name}"
        blocks.append(Figure(title, _densities(table, first), _SAYS.caption("density")))
        limits = [one.limit for one in results.requirements if one.statistic == "percentile"]
        history = _errors(table, min(limits, default=0.0))
        blocks.append(Figure("Pointing error over the day", (history,), _SAYS.caption("history")))
        others = tuple(
            Figure(
                f"Distribution of the pointing error, section {one.name}",
                _densities(table, one),
                _SAYS.caption("density"),
            )
            for one in rest
        )
        if others:
            blocks.append(Fold("Distributions in the other sections", others))
    return Panel("errors", "Pointing errors", "How are the pointing errors distributed?", tuple(blocks))


def _densities(table: Table, section: Section) -> tuple[Picture, ...]:
    t = table.columns["t"]
    inside = np.logical_and(table.valid, (t >= section.start_s) & (t < section.end_s))
    found = (("azimuth", "az", section.azimuth), ("elevation", "el", section.elevation))
    return (pointing.distributions([(name, table.columns[column][inside], one) for name, column, one in found]),)


def _errors(table: Table, limit: float) -> Picture:
    """Draw both axes' pointing error over the day: the range within each stretch of time."""
    t = table.columns["t"]
    size = series.stride(len(t), _POINTS)
    t0, step = series.times(t, size)
    with draw.style():
        figure, axes = draw.grid(3.0, 2, share_x=True)
        for axis, (column, name, color) in zip(axes, AXES, strict=True):
            mdeg = 1e3 * np.degrees(series.envelope(table.columns[column], size))
            axis.plot(t0 + step * np.arange(len(mdeg)), mdeg, color=color, linewidth=0.4)
            draw.limits(axis, -1e3 * np.degrees(limit), 1e3 * np.degrees(limit))
            axis.set_ylabel(f"{name} error / mdeg")
        axes[-1].set_xlim(0.0, float(t[-1]))
        axes[-1].set_xlabel("time / s")
        return draw.picture(figure, "Pointing error of either axis over the reference day", form="png")
