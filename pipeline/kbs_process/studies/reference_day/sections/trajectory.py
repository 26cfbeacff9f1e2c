"""Which satellite is tracked when, and by which angles?"""

from __future__ import annotations

import numpy as np

from kbs_process.report.panel import Block, Caption, Figure, Grid, Panel, Text
from kbs_process.report.tables import Tables
from kbs_process.report.text import number
from kbs_process.studies.reference_day import figures
from kbs_process.studies.reference_day.results import ReferenceDayResults

_ANGLES = Caption(
    shown="Desired azimuth and elevation, unwrapped within the mechanism's range; shaded with P and the satellite's "
    "name: the antenna goes to the other satellite. Below: the commanded rates. Numbers along the bottom: sections.",
    good="No jump; shaded stretches are short and lie where a satellite is lost; rates and angles stay within limits.",
    bad="A stretch at the end of azimuth's range: a satellite is lost to the stop, not to the Earth.",
    do="Where the stop ends a pass that matters, turn the mounting about the vertical.",
)


def panel(results: ReferenceDayResults, tables: Tables) -> Panel:
    """Figure of the angles, phases, and what the orbit asks of the mechanism."""
    blocks: list[Block] = []
    table = tables.read("day", "trajectory")
    if table is not None:
        pictures = (figures.trajectory(table, results.phases, results.sections), figures.rates(table))
        blocks.append(Figure("Trajectory of the reference day", pictures, _ANGLES))
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
    return Panel("trajectory", "Trajectory", "Which satellite is tracked when, and by which angles?", tuple(blocks))
