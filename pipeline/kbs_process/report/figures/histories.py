"""Time histories on paper: two curves over one another, and their difference beside them."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from kbs_process.report import series
from kbs_process.report.figures import draw
from kbs_process.report.panel import Picture
from kbs_process.report.text import unit
from kbs_process.signals.records import Array

_POINTS = 2400  # two for each pixel of the widest axes


def strips(
    t: Array,
    rows: tuple[series.Trace, ...],
    shaded: tuple[tuple[float, float], ...],
    *,
    computed_name: str,
    same_scale: bool,
    alt: str,
    title: str,
) -> Picture:
    """Draw one row a channel; on `same_scale` the residual shares its row's axis."""
    paired = any(row.residual is not None for row in rows)
    columns = 2 if paired else 1
    with draw.style():
        figure, axes = draw.ladder(len(rows), columns, 0.98 if len(rows) > 1 else 1.9, gap=0.12)
        for index, row in enumerate(rows):
            left = axes[index * columns]
            _curve(left, t, row.measured, "measured")
            if row.computed is not None:
                _curve(left, t, row.computed, computed_name)
            _limit(left, row)
            left.set_ylabel(f"{row.channel} / {unit(row.unit)}")
            if paired and row.residual is not None:
                right = axes[index * columns + 1]
                _curve(right, t, row.residual, "residual")
                if same_scale:
                    right.set_ylim(left.get_ylim())
        for axis in axes:
            for start, end in shaded:
                axis.axvspan(start, end, color=draw.SHADE, linewidth=0, zorder=0)
            axis.set_xlim(float(t[0]), float(t[-1]))
            axis.locator_params(axis="y", nbins=4)
        for axis in axes[:columns]:
            axis.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderaxespad=0.1)
        for axis in axes[:-columns]:
            axis.tick_params(labelbottom=False)
        for axis in axes[-columns:]:
            axis.set_xlabel("time / s")
        figure.align_ylabels()
        return draw.picture(figure, alt, title, "png")


def shows_limit(peak: float, limit: float) -> bool:
    """Say whether a limit is near enough to the curves to be drawn without flattening them."""
    return peak > 0.25 * limit


def _curve(axis: Axes, t: Array, values: Array, name: str) -> None:
    size = series.stride(len(values), _POINTS)
    first, step = series.times(t, size)
    points = series.envelope(values, size)
    axis.plot(first + step * np.arange(len(points)), points, label=name, **draw.LINES[name])


def _limit(axis: Axes, row: series.Trace) -> None:
    if row.limit is None or not shows_limit(float(np.nanmax(np.abs(row.measured), initial=0.0)), row.limit):
        return
    for sign in (-1.0, 1.0):
        axis.axhline(sign * row.limit, color=draw.LIMIT, linewidth=0.8, linestyle=(0, (4, 2)))
