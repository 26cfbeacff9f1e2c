"""Time histories on paper: two curves over one another, and their difference beside them."""

from __future__ import annotations

import numpy as np

from kbs_process.report import draw, series
from kbs_process.report.panel import Picture
from kbs_process.report.sheet import Panel, Sheet
from kbs_process.report.text import unit
from kbs_process.signals.records import Array, Mask

_POINTS = 1800  # at least two for each pixel of the widest panel


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
    """Draw one row a channel; on `same_scale` the residual shares its row's scale."""
    paired = any(row.residual is not None for row in rows)
    time = (float(t[0]), float(t[-1]))
    counts = _outside(t, shaded)
    with draw.style():
        sheet = Sheet(len(rows), 2 if paired else 1, 0.98 if len(rows) > 1 else 1.9, gap=0.12)
        for index, row in enumerate(rows):
            limits = _limits(row)
            shown = {"measured": row.measured, computed_name: row.computed}
            together = _range(*(curve[counts] for curve in shown.values() if curve is not None), np.array(limits))
            panels = [sheet.panel(index, 0, time, together)]
            _curves(panels[0], t, shown)
            panels[0].across(limits, colors=draw.LIMIT, linewidths=0.8, linestyles=[(0, (4, 2))], zorder=2.5)
            if row.residual is not None:
                panels.append(sheet.panel(index, 1, time, together if same_scale else _range(row.residual[counts])))
                _curves(panels[1], t, {"residual": row.residual})
            for place, panel in enumerate(panels):
                panel.shade(shaded)
                panel.frame(
                    "" if place else f"{row.channel} / {unit(row.unit)}",
                    below="time / s" if index == len(rows) - 1 else None,
                )
        computed = any(row.computed is not None for row in rows)
        sheet.key(0, ("measured", computed_name) if computed else ("measured",))
        if paired:
            sheet.key(1, ("residual",))
        return draw.picture(sheet.figure, alt, title, "png")


def shows_limit(peak: float, limit: float) -> bool:
    """Say whether a limit is near enough to the curves to be drawn without flattening them."""
    return peak > 0.25 * limit


def _curves(panel: Panel, t: Array, curves: dict[str, Array | None]) -> None:
    size = series.stride(len(t), _POINTS)
    first, step = series.times(t, size)
    for name, values in curves.items():
        if values is not None:
            points = series.envelope(values, size)
            panel.curve(first + step * np.arange(len(points), dtype=np.float64), points, draw.LINES[name])


def _outside(t: Array, stretches: tuple[tuple[float, float], ...]) -> Mask:
    """Return which times lie in none of the stretches, or all of them where none would be left."""
    outside = np.ones(len(t), dtype=np.bool_)
    for start, end in stretches:
        outside &= (t < start) | (t > end)
    return outside if outside.any() else ~outside


def _range(*curves: Array) -> tuple[float, float]:
    """Return limits that leave a little room about all finite values."""
    low, high = 0.0, 0.0
    found = [curve[np.isfinite(curve)] for curve in curves]
    if any(values.size for values in found):
        low = min(float(values.min()) for values in found if values.size)
        high = max(float(values.max()) for values in found if values.size)
    room = 0.05 * (high - low) or 0.05 * abs(high) or 1.0
    return low - room, high + room


def _limits(row: series.Trace) -> tuple[float, ...]:
    """Return the levels of the limit, if it is to be drawn."""
    if row.limit is None or not shows_limit(float(np.nanmax(np.abs(row.measured), initial=0.0)), row.limit):
        return ()
    return -row.limit, row.limit
