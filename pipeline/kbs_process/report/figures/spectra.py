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
    with draw.style():
        figure, axes = draw.ladder(rows, columns, 1.14 if rows > 1 else 2.2, gap=0.12)
        # The drawn order runs down the columns: forces left, torques right.
        grid = np.reshape(np.array(axes, dtype=object), (rows, columns)).T.ravel()
        for axis, channel in zip(grid, channels, strict=False):
            _curves(axis, table, channel)
            _marks(axis, resonances, edges, named=axis is grid[0])
            axis.set_ylabel(f"{channel} / ({unit(table.unit(channel))})²/Hz")
        for axis in grid[len(channels) :]:
            axis.remove()
        for column in range(columns):
            bottom = min((column + 1) * rows, len(channels)) - 1
            for axis in grid[column * rows : bottom]:
                axis.tick_params(labelbottom=False)
            if bottom >= column * rows:
                grid[bottom].set_xlabel("frequency / Hz")
        grid[0].legend(loc="lower left", fontsize=6.5)
        return draw.picture(figure, alt, title, "png")


def _curves(axis: Axes, table: Table, channel: str) -> None:
    """Draw the channel's densities; noughts, which a logarithmic axis cannot show, are left out."""
    f = table.columns["f"]
    shown = [
        (kind, *_thinned(f, table.columns[f"{channel}.{kind}"]))
        for kind in ("predicted", "measured")
        if f"{channel}.{kind}" in table.columns
    ]
    for kind, frequency, density in shown:
        axis.plot(frequency, density, label=kind, **draw.LINES[kind])
    densities = np.concatenate([density for _, _, density in shown])
    if densities.size:
        draw.logarithmic(axis, "x", float(f[f > 0].min()), float(f.max()))
        draw.logarithmic(axis, "y", 0.5 * float(densities.min()), 2.0 * float(densities.max()))


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


def _marks(axis: Axes, resonances: tuple[Resonance, ...], edges: tuple[float, ...], *, named: bool) -> None:
    for edge in edges:
        axis.axvline(edge, color=draw.INK, linewidth=0.7, linestyle=(0, (1, 1.5)), zorder=1)
    ordered = sorted(resonances, key=lambda resonance: resonance.frequency_Hz)
    for index, resonance in enumerate(ordered):
        axis.axvline(resonance.frequency_Hz, color=draw.LIMIT, linewidth=0.7, linestyle=(0, (4, 2)), zorder=1)
        if named:
            # Neighbours stand on opposite sides of their lines, as the first two are often close.
            side = -1 if index % 2 == 0 else 1
            axis.annotate(
                f"{label(resonance.axis, 12)} {number(resonance.frequency_Hz)} Hz",
                (resonance.frequency_Hz, 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(1.5 * side, -1),
                textcoords="offset points",
                rotation=90,
                ha="right" if side < 0 else "left",
                va="top",
                fontsize=5.5,
                color=draw.LIMIT,
                bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.4},
            )
