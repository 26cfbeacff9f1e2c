"""Profile likelihoods and correlations of an identification."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.figure import Figure

from kbs_process.report import draw
from kbs_process.report.panel import Picture
from kbs_process.report.text import number, unit
from kbs_process.studies.identify.results import Correlations, Identified

_LEVEL = 3.84
_COLUMNS = 3


def profiles(entries: tuple[Identified, ...], title: str) -> Picture:
    """Draw each profile over the parabola of the estimate's sigma."""
    rows = math.ceil(len(entries) / _COLUMNS)
    with draw.style():
        figure = Figure(figsize=(draw.WIDTH, 0.3 + 1.5 * rows), layout="constrained")
        axes = np.atleast_1d(figure.subplots(rows, _COLUMNS, squeeze=False)).ravel()
        for axis, entry in zip(axes, entries, strict=False):
            assert entry.interval is not None
            x = np.linspace(-3.0, 3.0, 61)
            axis.plot(entry.value + entry.sigma * x, x**2, color=draw.RESIDUAL, linewidth=0.8)
            axis.plot(entry.interval.x, entry.interval.D, marker="o", markersize=3, color=draw.MEASURED)
            axis.axhline(_LEVEL, color=draw.LIMIT, linewidth=0.8, linestyle="--")
            for end in (entry.interval.low, entry.interval.high):
                axis.axvline(end, color=draw.MEASURED, linewidth=0.6, linestyle=":")
            axis.set_ylim(-0.3, 9.0)
            axis.set_title(entry.name.rpartition(".")[2])
            axis.set_xlabel(unit(entry.unit))
            axis.tick_params(axis="x", labelsize=6)
            axis.locator_params(axis="x", nbins=4)
        for axis in axes[len(entries) :]:
            axis.set_axis_off()
        return draw.picture(figure, f"{title}: profile likelihood of {len(entries)} parameters", title)


def correlations(found: Correlations) -> Picture:
    """Draw the correlation matrix."""
    names = [name.removeprefix("joint.").replace(".drive.", " ").replace("transducer.", "") for name in found.names]
    with draw.style():
        figure = Figure(figsize=(draw.WIDTH, draw.WIDTH * 0.9), layout="constrained")
        axis = figure.subplots()
        image = axis.imshow(np.array(found.matrix), cmap="RdBu_r", vmin=-1.0, vmax=1.0)
        axis.set_xticks(range(len(names)), names, rotation=90, fontsize=5.5)
        axis.set_yticks(range(len(names)), names, fontsize=5.5)
        axis.grid(visible=False)
        figure.colorbar(image, ax=axis, shrink=0.7, label="correlation")
        worst = max(
            (abs(value) for i, row in enumerate(found.matrix) for j, value in enumerate(row) if i != j), default=0.0
        )
        return draw.picture(figure, f"Correlations of {len(names)} estimates, at most {number(worst, 2)}")
