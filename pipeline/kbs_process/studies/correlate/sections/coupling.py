"""Cross-coupling between the transducer's channels."""

from __future__ import annotations

import numpy as np

from kbs_process.report import draw
from kbs_process.report.panel import Block, Figure, Grid, Panel, Picture, Text
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Tables
from kbs_process.report.text import number, unit
from kbs_process.studies.correlate.results import CrossCoupling, Results

_SAYS = Prose("kbs_process.studies.correlate", "coupling")


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
        Figure("Cross-coupling matrix, × 10⁻³", (_matrix(found, alt),), _SAYS.caption("matrix")),
    ]
    if found.contributions:
        rows = tuple((entry.channel, number(entry.value), unit(entry.unit)) for entry in found.contributions)
        blocks.append(Grid("Removed by decoupling, rms", ("Channel", "rms", "Unit"), rows, "lrl"))
    return Panel("coupling", "Cross-coupling", question, tuple(blocks))


def _matrix(coupling: CrossCoupling, alt: str) -> Picture:
    """Draw every element in thousandths with its sigma; the colour is its size over its sigma."""
    values, sigma = np.round(coupling.matrix, 12), np.array(coupling.sigma)  # rounding errors are no coupling
    known = sigma > 0
    significance = np.divide(np.abs(values), sigma, out=np.zeros_like(values), where=known)
    n = len(coupling.channels)
    with draw.style():
        figure, axis = draw.canvas(0.6 + 0.42 * n, width=min(draw.WIDTH, 1.2 + 1.0 * n))
        axis.imshow(np.minimum(significance, 10.0), cmap="Blues", vmin=0.0, vmax=16.0, aspect="auto")
        for row in range(n):
            for column in range(n):
                text = number(1e3 * values[row, column], 2)
                spread = f"\n± {number(1e3 * sigma[row, column], 2)}" if known[row, column] else ""
                axis.text(column, row, text + spread, ha="center", va="center", fontsize=6.5)
        axis.set_xticks(range(n), coupling.channels)
        axis.set_yticks(range(n), coupling.channels)
        axis.set_xlabel("true channel")
        axis.set_ylabel("raw channel")
        axis.grid(visible=False)
        axis.tick_params(length=0)
        return draw.picture(figure, alt)
