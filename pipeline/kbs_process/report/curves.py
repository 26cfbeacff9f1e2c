"""Spectra and histories of what a model leaves, before and after a fit."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.figure import Figure

from kbs_process.report import draw
from kbs_process.report.panel import Picture
from kbs_process.report.sheet import Sheet
from kbs_process.report.tables import Table
from kbs_process.report.text import unit
from kbs_process.signals.records import Array

_POINTS = 900
_LOOKS = {"before": draw.LINES["predicted"], "after": draw.LINES["measured"]}


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
                f, table.columns[f"{channel}.noise"], color=draw.LIMIT, linewidth=0.8, linestyle="--", label=below
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
        return draw.picture(sheet.figure, f"{title}: what is unexplained, before (pale) and after", title, "png")


def _extremes(x: Array, stride: int) -> Array:
    """Least and greatest value of every `stride` samples, in turn."""
    starts = np.arange(0, len(x), stride)
    return np.column_stack([np.minimum.reduceat(x, starts), np.maximum.reduceat(x, starts)]).ravel()
