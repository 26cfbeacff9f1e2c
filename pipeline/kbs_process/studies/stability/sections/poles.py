"""Frequency and damping of the poles over the swept joint."""

from __future__ import annotations

from kbs_process.report.panel import Block, Caption, Figure, Panel, Text
from kbs_process.report.tables import Tables
from kbs_process.report.text import number
from kbs_process.studies.stability import figures
from kbs_process.studies.stability.results import StabilityResults

_CAPTION = Caption(
    shown="Frequency (left) and damping (right) of every pole over the swept joint's angle: hollow, of the plant with "
    "its field held; full, of the closed loop. Dotted: half the cycle's rate.",
    good="The plant's modes keep their damping when the loop is closed, and the loop's own poles are well damped.",
    bad="A closed-loop pole whose damping falls towards nought at some poses.",
    do="Compare its frequency with the plant's modes, folded at the dotted line, to see which one the loop excites.",
)


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
            "closed loop's poles, folded at that frequency."
        )
        alt = "Frequency and damping of poles over the angle of the swept joint"
        picture = figures.poles(table, results.joint, nyquist, alt)
        blocks += [Text(words), Figure("Poles over the range", (picture,), _CAPTION)]
    return Panel("poles", "Poles", question, tuple(blocks))
