"""Profile likelihoods, correlations, and what is left unexplained before and after an identification."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.figure import Figure

from kbs_process.report.figures import draw
from kbs_process.report.figures.sheet import Sheet
from kbs_process.report.panel import Picture
from kbs_process.report.records.identify import Correlations, Identified
from kbs_process.report.tables import Table
from kbs_process.report.text import number, unit
from kbs_process.signals.records import Array

_LEVEL = 3.84
_COLUMNS = 3
_POINTS = 900
_LOOKS = {"before": draw.LINES["predicted"], "after": draw.LINES["measured"]}


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
    names = [
        name.removeprefix("joint.").replace(".drive.", " ").replace("transducer.", "") for name in found.names
    ]
    with draw.style():
        figure = Figure(figsize=(draw.WIDTH, draw.WIDTH * 0.9), layout="constrained")
        axis = figure.subplots()
        image = axis.imshow(np.array(found.matrix), cmap="RdBu_r", vmin=-1.0, vmax=1.0)
        axis.set_xticks(range(len(names)), names, rotation=90, fontsize=5.5)
        axis.set_yticks(range(len(names)), names, fontsize=5.5)
        axis.grid(visible=False)
        figure.colorbar(image, ax=axis, shrink=0.7, label="correlation")
        worst = max(
            (abs(value) for i, row in enumerate(found.matrix) for j, value in enumerate(row) if i != j),
            default=0.0,
        )
        return draw.picture(figure, f"Correlations of {len(names)} estimates, at most {number(worst, 2)}")


def spectra(table: Table, channels: tuple[str, ...], title: str, *, below: str = "sensor's noise") -> Picture:
    """Draw residual spectra before and after, and what they are to come down to; of no unit, they are over that."""
    f = table.columns["f"]
    with draw.style():
        figure = Figure(figsize=(draw.WIDTH, 0.3 + 1.35 * math.ceil(len(channels) / 2)), layout="constrained")
        axes = np.atleast_1d(figure.subplots(math.ceil(len(channels) / 2), 2, squeeze=False)).ravel()
        for axis, channel in zip(axes, channels, strict=False):
            for side, look in _LOOKS.items():
                centre, level = _smoothed(f, table.columns[f"{channel}.{side}"])
                axis.plot(centre, level, color=look["color"], linewidth=1.0, label=side)
            axis.plot(
                f,
                table.columns[f"{channel}.noise"],
                color=draw.LIMIT,
                linewidth=0.8,
                linestyle="--",
                label=below,
            )
            shown = np.concatenate([line.get_ydata() for line in axis.lines])
            draw.logarithmic(axis, "x", float(f[0]), float(f[-1]))
            draw.logarithmic(axis, "y", 0.5 * float(shown.min()), 2.0 * float(shown.max()))
            axis.set_title(channel)
            name = table.unit(f"{channel}.after")
            axis.set_ylabel(f"PSD over the {below}" if name == "1" else unit(name))
        for axis in axes[max(len(channels) - 2, 0) : len(channels)]:
            axis.set_xlabel("frequency / Hz")
        for axis in axes[len(channels) :]:
            axis.set_axis_off()
        axes[0].legend(fontsize=6)
        return draw.picture(figure, f"{title}: spectra of what is unexplained, before and after", title)


def _smoothed(f: Array, power: Array) -> tuple[Array, Array]:
    """Means over equal steps of log f."""
    bins = np.unique(np.searchsorted(f, np.geomspace(f[0], f[-1], 80)))
    bins = bins[bins < len(f)]
    count = np.diff([*bins, len(f)])
    return np.add.reduceat(f, bins) / count, np.add.reduceat(power, bins) / count


def histories(table: Table, channels: tuple[str, ...], title: str) -> Picture:
    """Draw residual histories, before under after."""
    t = table.columns["t"]
    stride = max(1, len(t) // _POINTS)
    with draw.style():
        sheet = Sheet(len(channels), 1, 0.98, gap=0.12)
        for row, channel in enumerate(channels):
            curves = {side: _extremes(table.columns[f"{channel}.{side}"], stride) for side in _LOOKS}
            most = 1.05 * max(float(np.max(np.abs(curve))) for curve in curves.values()) or 1.0
            panel = sheet.panel(row, 0, (float(t[0]), float(t[-1])), (-most, most))
            for side, look in _LOOKS.items():
                panel.curve(np.linspace(t[0], t[-1], len(curves[side])), curves[side], look)
            panel.frame(
                f"{channel} / {unit(table.unit(f'{channel}.after'))}",
                below="time / s" if row == len(channels) - 1 else None,
            )
        return draw.picture(
            sheet.figure, f"{title}: what is unexplained, before (pale) and after", title, "png"
        )


def _extremes(x: Array, stride: int) -> Array:
    """Least and greatest value of every `stride` samples, in turn."""
    starts = np.arange(0, len(x), stride)
    return np.column_stack([np.minimum.reduceat(x, starts), np.maximum.reduceat(x, starts)]).ravel()
