"""Signs and frames: printed, drawn and tested on the campaign's own data."""

from __future__ import annotations

from kbs_process.report.panel import Block, Caption, Cell, Figure, Grid, Panel, Text
from kbs_process.report.tables import Tables
from kbs_process.studies.correlate.figures import frames
from kbs_process.studies.correlate.results import Results

_CAPTION = Caption(
    shown="Frame T on the transducer's top plate, with the positive sense of each torque (right-handed). "
    "The wrench in this report is what the unit exerts on the transducer, about T's origin, in T's axes.",
    good="All self-tests below pass.",
    bad="A failed test: a sign, an axis or a taring differs between the recorder and the campaign's description.",
    do="Correct the rig's description, or the recorder's channel signs, and process again; never correct "
    "a sign in the results.",
)
_DEFINITIONS = (
    "T: fixed to the transducer's top plate, origin at its reference point; z up where the set-up is level.",
    "Wrench: force and torque that the unit exerts on the transducer; at rest, with z up, Fz is minus the weight.",
    "Torques: Tx = Σ (y Fz − z Fy), and so on: r × F.",
)
_SPACECRAFT = "S: at the spacecraft's centre of mass; its place and attitude with respect to T are the campaign's."


def panel(results: Results, tables: Tables) -> Panel:
    """Definitions, the drawing, and the outcome of every self-test."""
    frames_used = {row.frame for row in results.merit} | {row.frame for row in results.requirements}
    spacecraft = "S" in frames_used
    picture = frames.frames("Frame T with its axes and positive torques", spacecraft=spacecraft)
    definitions = (*_DEFINITIONS, _SPACECRAFT) if spacecraft else _DEFINITIONS
    blocks: list[Block] = [Text("Definitions:", definitions), Figure("Frames and signs", (picture,), _CAPTION)]
    rows = tuple(
        (entry.check, entry.expected, entry.found, Cell("ok" if entry.ok else "failed", "pass" if entry.ok else "fail"))
        for entry in results.conventions
    )
    if rows:
        blocks.append(
            Grid("Self-tests on this campaign's data", ("Check", "Expected", "Found", "Outcome"), rows, "lllc")
        )
    else:
        blocks.append(Text("No self-test of signs and frames was made."))
    return Panel("conventions", "Signs and frames", "Do recorder and model mean the same by every sign?", tuple(blocks))
