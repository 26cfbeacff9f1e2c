"""Distributions of pointing errors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kbs_process.report import draw
from kbs_process.report.panel import Picture
from kbs_process.results.pointing import PointingEstimate
from kbs_process.signals.records import Array

_BINS = 60


def distributions(found: Sequence[tuple[str, Array, PointingEstimate]], title: str = "") -> Picture:
    """Draw each axis' density about its bias, the normal one of equal width, and its 95 %; no error is constant."""
    with draw.style():
        figure, _ = draw.canvas(2.3)
        figure.clear()
        axes = np.atleast_1d(figure.subplots(1, len(found)))
        for axis, (name, error, estimate) in zip(axes, found, strict=True):
            random = 1e3 * np.degrees(error - estimate.bias)
            deviation = 1e3 * np.degrees(estimate.random) / 2.0
            inside = float(np.quantile(np.abs(random), 0.95))
            axis.hist(random, bins=_BINS, density=True, histtype="stepfilled", color=draw.MEASURED, alpha=0.55)
            reach = float(np.abs(random).max())
            x = np.linspace(-reach, reach, 400)
            normal = np.exp(-0.5 * (x / deviation) ** 2) / (deviation * np.sqrt(2.0 * np.pi))
            axis.plot(x, normal, color=draw.PREDICTED, linewidth=1.2, label="normal, same σ")
            for level in (-inside, inside):
                axis.axvline(level, color=draw.INK, linewidth=0.9, linestyle=(0, (4, 2)))
            axis.set_xlabel("random error / mdeg")
            axis.set_title(f"{name}: 95 % within {inside:.1f} mdeg")
        axes[0].set_ylabel("density / 1/mdeg")
        axes[0].legend(loc="upper left", fontsize=6.5)
        names = " and ".join(name for name, _, _ in found)
        return draw.picture(figure, f"{title} density of the random pointing error in {names}".strip(), title)
