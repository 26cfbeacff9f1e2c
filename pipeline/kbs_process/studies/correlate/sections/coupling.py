"""Cross-coupling between the transducer's channels."""

from __future__ import annotations

from kbs_process.report.panel import Block, Caption, Figure, Grid, Panel, Text
from kbs_process.report.tables import Tables
from kbs_process.report.text import number, unit
from kbs_process.studies.correlate.figures import coupling
from kbs_process.studies.correlate.results import Results

_CAPTION = Caption(
    shown="X in raw = (I + X) wrench, in thousandths of the SI unit of the channel pair, with one "
    "standard deviation below. The darker a field, the more standard deviations its element is from zero.",
    good="Small elements with small uncertainties; the same matrix from calibration to calibration.",
    bad="An element that turns a large force (the weight) into as much torque as the disturbance sought, "
    "or whose uncertainty does.",
    do="Multiply the element's σ by the static force of its column and compare with the budget. If it "
    "counts, repeat the calibration of that pair with dead weights.",
)


def panel(results: Results, tables: Tables) -> Panel:
    """The matrix, and what its removal changed on each channel."""
    question = "How much do forces leak into torques, and what did removing that change?"
    found = results.cross_coupling
    if found is None:
        text = Text("No cross-coupling matrix is given: channels are taken as independent.")
        return Panel("coupling", "Cross-coupling", question, (text,))
    alt = f"Cross-coupling matrix of {', '.join(found.channels)}"
    blocks: list[Block] = [
        Text(found.largest),
        Figure("Cross-coupling matrix, × 10⁻³", (coupling.matrix(found, alt),), _CAPTION),
    ]
    if found.contributions:
        rows = tuple((entry.channel, number(entry.value), unit(entry.unit)) for entry in found.contributions)
        blocks.append(Grid("Taken away by decoupling, rms", ("Channel", "rms", "Unit"), rows, "lrl"))
    return Panel("coupling", "Cross-coupling", question, tuple(blocks))
