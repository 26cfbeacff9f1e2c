"""The transducer's cross-coupling matrix."""

from __future__ import annotations

import numpy as np

from kbs_process.report import draw
from kbs_process.report.panel import Picture
from kbs_process.report.text import number
from kbs_process.studies.correlate.results import CrossCoupling


def matrix(coupling: CrossCoupling, alt: str) -> Picture:
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
