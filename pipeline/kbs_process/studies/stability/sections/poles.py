"""Frequency and damping of the poles over the swept joint."""

from __future__ import annotations

import numpy as np

from kbs_process.report import draw
from kbs_process.report.panel import Block, Figure, Panel, Picture, Text
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Table, Tables
from kbs_process.report.text import number
from kbs_process.studies.stability.results import StabilityResults

_SAYS = Prose("kbs_process.studies.stability", "poles")


def panel(results: StabilityResults, tables: Tables) -> Panel:
    """The map of poles."""
    question = "Which modes does the loop touch, and how do they move with the pose?"
    table = tables.read("stability", "poles")
    blocks: list[Block] = []
    if table is None:
        blocks.append(Text("The table of poles is missing."))
    else:
        nyquist = 0.5 / results.cycle_s
        words = (
            f"The controller sees one sample a cycle: a mode above {number(nyquist)} Hz appears to it, and among the "
            "closed loop's poles, aliased below that frequency."
        )
        alt = "Frequency and damping of poles over the angle of the swept joint"
        picture = _poles(table, results.joint, nyquist, alt)
        blocks += [Text(words), Figure("Poles over the range", (picture,), _SAYS.caption("poles"))]
    return Panel("poles", "Poles", question, tuple(blocks))


def _poles(table: Table, joint: str, nyquist: float, alt: str) -> Picture:
    """Draw frequency and damping of the plant's and the closed loop's poles."""
    angle, frequency, damping = (table.columns[name] for name in ("angle", "frequency", "damping"))
    closed = table.columns["closed"] > 0.5
    with draw.style():
        figure, (left, right) = draw.row(3.0, 2)
        for axis, values in ((left, frequency), (right, damping)):
            axis.plot(
                np.degrees(angle[~closed]), values[~closed], linestyle="none", marker="o", markersize=4.5,
                markerfacecolor="none", markeredgecolor=draw.PREDICTED, label="plant, field held",
            )  # fmt: skip
            axis.plot(
                np.degrees(angle[closed]), values[closed], linestyle="none", marker=".", markersize=4.0,
                color=draw.MEASURED, label="closed loop",
            )  # fmt: skip
            axis.set_xlabel(f"{joint} / °")
        left.axhline(nyquist, color=draw.INK, linewidth=0.7, linestyle=(0, (1, 1.5)))
        draw.logarithmic(left, "y", 0.7 * float(frequency.min()), 1.4 * float(frequency.max()))
        draw.logarithmic(right, "y", 0.5 * max(1e-4, float(np.abs(damping).min())), 1.5)
        left.set_ylabel("frequency / Hz")
        right.set_ylabel("damping of critical")
        left.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, fontsize=6.5)
        return draw.picture(figure, alt)
