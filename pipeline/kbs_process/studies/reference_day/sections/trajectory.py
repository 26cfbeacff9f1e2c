"""Which satellite is tracked when, and at which angles?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kbs_process.report import draw
from kbs_process.report.panel import Block, Figure, Grid, Panel, Picture, Text
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Table, Tables
from kbs_process.report.text import number
from kbs_process.studies.reference_day.results import Phase, ReferenceDayResults, Section

_SAYS = Prose("kbs_process.studies.reference_day", "trajectory")
AXES = (("az", "azimuth", draw.MEASURED), ("el", "elevation", draw.PREDICTED))
_POINTS = 3000  # of a curve over the day


def panel(results: ReferenceDayResults, tables: Tables) -> Panel:
    """Figure of the angles, phases, and what the orbit asks of the mechanism."""
    blocks: list[Block] = []
    table = tables.read("day", "trajectory")
    if table is not None:
        pictures = (_trajectory(table, results.phases, results.sections), _rates(table))
        blocks.append(Figure("Trajectory of the reference day", pictures, _SAYS.caption("angles")))
    g = results.geometry
    blocks.append(
        Text(
            f"Orbit by SGP4 from {g.epoch}: nodal period {g.nodal_period_s:.2f} s, mean semi-major axis "
            f"{g.semi_major_axis_m / 1e3:.1f} km, the node turns {np.degrees(g.node_rate) * 86400.0:.4f} ° a day. "
            f"Azimuth {np.degrees(g.azimuth[0]):.1f} to {np.degrees(g.azimuth[1]):.1f} °, elevation "
            f"{np.degrees(g.elevation[0]):.1f} to {np.degrees(g.elevation[1]):.1f} °; at most "
            f"{np.degrees(g.greatest_rate):.3f} of {np.degrees(g.rate_limit):.3g} °/s and "
            f"{np.degrees(g.greatest_acceleration):.4f} of {np.degrees(g.acceleration_limit):.3g} °/s²."
        )
    )
    rows = tuple(
        (phase.mode, phase.relay, f"{phase.start_s:.1f}", f"{phase.end_s:.1f}", number(phase.end_s - phase.start_s, 4))
        for phase in results.phases
    )
    blocks.append(Grid("Phases", ("Mode", "Satellite", "From / s", "To / s", "Duration / s"), rows, "llrrr"))
    return Panel("trajectory", "Trajectory", "Which satellite is tracked when, and at which angles?", tuple(blocks))


def _trajectory(table: Table, phases: Sequence[Phase], sections: Sequence[Section]) -> Picture:
    """Draw desired azimuth and elevation over the day; hand-overs shaded and named, sections numbered."""
    t = table.columns["t"]
    thin = max(1, len(t) // _POINTS)
    with draw.style():
        figure, axis = draw.canvas(3.3)
        for column, name, color in AXES:
            axis.plot(t[::thin], np.degrees(table.columns[column][::thin]), color=color, linewidth=1.1, label=name)
        axis.set_ylim(-60.0, 205.0)
        for phase in phases:
            if phase.mode in ("hand-over", "pre-pointing"):
                axis.axvspan(phase.start_s, phase.end_s, color=draw.SHADE, linewidth=0)
                axis.text(phase.start_s, 200.0, f"P {phase.relay}", ha="center", va="top", fontsize=6.5)
            elif phase.start_s <= 0.0:
                axis.text(0.0, 200.0, f" {phase.relay}", ha="left", va="top", fontsize=6.5)
        for section in sections:
            axis.axvline(section.end_s, color=draw.GRID, linewidth=0.8, zorder=0.6)
            axis.text(0.5 * (section.start_s + section.end_s), -57.0, section.name, ha="center", color=draw.TICK)
        axis.set_xlim(0.0, float(t[-1]))
        axis.set_xlabel("time / s")
        axis.set_ylabel("angle / °")
        axis.legend(loc="center right")
        return draw.picture(figure, "Desired azimuth and elevation over the reference day", form="png")


def _rates(table: Table) -> Picture:
    """Draw the commanded rates over the day."""
    t = table.columns["t"]
    thin = max(1, len(t) // _POINTS)
    with draw.style():
        figure, axis = draw.canvas(1.9)
        for column, name, color in AXES:
            rate = np.degrees(np.gradient(table.columns[column], t))
            axis.plot(t[::thin], rate[::thin], color=color, linewidth=0.9, label=name)
        axis.set_xlim(0.0, float(t[-1]))
        axis.set_xlabel("time / s")
        axis.set_ylabel("rate / °/s")
        axis.legend(loc="upper right", ncols=2)
        return draw.picture(figure, "Commanded rates over the reference day", form="png")
