"""Power spectral densities with the resonances and the band edges on them."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes

from kbs_process.report.figures import draw
from kbs_process.report.panel import Picture
from kbs_process.report.results import Resonance
from kbs_process.report.tables import Table
from kbs_process.report.text import label, number, unit
from kbs_process.signals.records import Array

_BINS = 500


def spectra(
    table: Table, resonances: tuple[Resonance, ...], edges: tuple[float, ...], *, alt: str, title: str
) -> Picture:
    """Draw measured and predicted density of every channel on logarithmic axes."""
    channels = table.channels
    columns = 2 if len(channels) > 1 else 1
    rows = math.ceil(len(channels) / columns)
    f = table.columns["f"]
    with draw.style():
        figure, axes = draw.canvas(0.5 + (1.75 if rows > 1 else 2.4) * rows, rows, columns)
        # The drawn order runs down the columns: forces left, torques right.
        grid = np.reshape(np.array(axes, dtype=object), (rows, columns)).T.ravel()
        for axis, channel in zip(grid, channels, strict=False):
            for kind, color in (("measured", draw.MEASURED), ("predicted", draw.PREDICTED)):
                density = table.columns.get(f"{channel}.{kind}")
                if density is not None:
                    axis.plot(*_thinned(f, density), color=color, label=kind, linewidth=0.7)
            _marks(axis, resonances, edges)
            axis.set(xscale="log", yscale="log")
            axis.set_ylabel(f"{channel} / ({unit(table.unit(channel))})²/Hz")
        for axis in grid[len(channels) :]:
            axis.remove()
        for column in range(columns):
            bottom = min((column + 1) * rows, len(channels)) - 1
            if bottom >= column * rows:
                grid[bottom].set_xlabel("frequency / Hz")
        grid[0].legend(loc="lower left", fontsize=6.5)
        return draw.picture(figure, alt, title)


def _thinned(f: Array, density: Array) -> tuple[Array, Array]:
    """Keep the greatest density of each of many equal steps of log frequency, so that no line is lost."""
    usable = (f > 0) & (density > 0)
    f, density = f[usable], density[usable]
    if len(f) <= _BINS:
        return f, density
    step = np.log(f[-1] / f[0]) / _BINS
    bins = np.minimum((np.log(f / f[0]) / step).astype(np.intp), _BINS - 1)
    order = np.lexsort((-density, bins))
    keep = np.sort(order[np.unique(bins[order], return_index=True)[1]])
    return f[keep], density[keep]


def _marks(axis: Axes, resonances: tuple[Resonance, ...], edges: tuple[float, ...]) -> None:
    for edge in edges:
        axis.axvline(edge, color=draw.RESIDUAL, linewidth=0.7, linestyle=(0, (1, 1.5)))
    for resonance in resonances:
        axis.axvline(resonance.frequency_Hz, color=draw.LIMIT, linewidth=0.7, linestyle=(0, (4, 2)))
        axis.annotate(
            f"{label(resonance.axis, 12)} {number(resonance.frequency_Hz)} Hz",
            (resonance.frequency_Hz, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(-1.5, -2),
            textcoords="offset points",
            rotation=90,
            ha="right",
            va="top",
            fontsize=5.5,
            color=draw.LIMIT,
        )
