"""Many small panels on one sheet of paper.

They share one pair of axes whose unit is the inch, and bring their own scales: matplotlib's own axes, ticks
and fitted margins take ten times as long, and a report has hundreds of panels.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import LogLocator, MaxNLocator
from matplotlib.transforms import Bbox, TransformedBbox

from kbs_process.report import draw
from kbs_process.report.text import power, steps
from kbs_process.signals.records import Array

_LEFT, _RIGHT, _TOP, _BOTTOM, _BETWEEN = 0.7, 0.06, 0.22, 0.42, 0.7  # in
_TICK = 0.035  # in


@dataclass(frozen=True, slots=True)
class Scale:
    """A range of values along a stretch of the sheet (in)."""

    low: float
    high: float
    start: float
    end: float
    logarithmic: bool = False

    def place(self, values: Array | float) -> Array:
        """Where values are on the sheet (in); those of a logarithmic scale must be positive."""
        low, high = (math.log10(self.low), math.log10(self.high)) if self.logarithmic else (self.low, self.high)
        along = np.log10(values) if self.logarithmic else np.asarray(values)
        return np.asarray(self.start + (along - low) * ((self.end - self.start) / ((high - low) or 1.0)))

    def ticks(self, most: int) -> tuple[list[float], list[str]]:
        """Round values within the range, at most about so many, and their labels."""
        decades = math.log10(self.high / self.low) if self.logarithmic else 0.0
        if decades < 1.0:
            values = MaxNLocator(most, steps=[1, 2, 2.5, 5, 10]).tick_values(self.low, self.high)
        else:
            subs = (1.0, 2.0, 5.0) if decades < 2.0 else (1.0,)
            values = LogLocator(subs=subs, numticks=most + 1).tick_values(self.low, self.high)
        inside = [float(value) for value in values if self.low <= value <= self.high]
        return inside, [power(value) for value in inside] if decades >= 1.0 else steps(inside)


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """One panel: a horizontal and a vertical scale, and what is drawn on them."""

    sheet: Sheet
    x: Scale
    y: Scale

    def curve(self, x: Array, y: Array, look: dict[str, Any]) -> None:
        """Draw a curve, cut off at the panel's edges."""
        line = Line2D(self.x.place(x), self.y.place(y), solid_joinstyle="bevel", **look)
        line.set_clip_box(self._box())
        self.sheet.axes.add_artist(line)

    def across(self, values: Iterable[float], **look: Any) -> None:
        """Draw a horizontal line at each value."""
        places = [float(self.y.place(value)) for value in values]
        self._lines([((self.x.start, at), (self.x.end, at)) for at in places], **look)

    def upright(self, values: Iterable[float], **look: Any) -> None:
        """Draw a vertical line at each value."""
        places = [float(self.x.place(value)) for value in values]
        self._lines([((at, self.y.start), (at, self.y.end)) for at in places], **look)

    def shade(self, stretches: Iterable[tuple[float, float]]) -> None:
        """Shade stretches of the horizontal axis."""
        for start, end in stretches:
            left, right = (float(self.x.place(min(max(edge, self.x.low), self.x.high))) for edge in (start, end))
            size = (right - left, self.y.end - self.y.start)
            self.sheet.axes.add_artist(
                Rectangle((left, self.y.start), *size, facecolor=draw.SHADE, linewidth=0, zorder=0)
            )

    def frame(self, label: str, *, below: str | None) -> None:
        """Draw axes with their ticks, a faint grid and labels; those of the horizontal axis if `below` is given."""
        x_values, x_labels = self.x.ticks(8)
        y_values, y_labels = self.y.ticks(4)
        at_x, at_y = self.x.place(np.array(x_values)), self.y.place(np.array(y_values))
        left, bottom = self.x.start, self.y.start
        self.upright(x_values, colors=draw.GRID, linewidths=0.6, zorder=0.5)
        self.across(y_values, colors=draw.GRID, linewidths=0.6, zorder=0.5)
        axes = [((left, self.y.end), (left, bottom)), ((left, bottom), (self.x.end, bottom))]
        marks = [((x, bottom), (x, bottom - _TICK)) for x in at_x] + [((left, y), (left - _TICK, y)) for y in at_y]
        self._lines(axes + marks, colors=draw.AXIS, linewidths=0.6, zorder=2.5)
        write = self.sheet.axes.text
        for y, text in zip(at_y, y_labels, strict=True):
            write(left - 2 * _TICK, y, text, ha="right", va="center", color=draw.TICK)
        middle = (self.y.start + self.y.end) / 2
        write(left - 0.65, middle, label, rotation=90, ha="left", va="center")
        if below is not None:
            for x, text in zip(at_x, x_labels, strict=True):
                write(x, bottom - 2 * _TICK, text, ha="center", va="top", color=draw.TICK)
            write((left + self.x.end) / 2, bottom - 0.23, below, ha="center", va="top")

    def _lines(self, segments: list[Any], **look: Any) -> None:
        self.sheet.axes.add_artist(LineCollection(segments, **look))

    def _box(self) -> TransformedBbox:
        box = Bbox.from_extents(self.x.start, self.y.start, self.x.end, self.y.end)
        return TransformedBbox(box, self.sheet.axes.transData)


class Sheet:
    """A sheet with places for rows and columns of panels."""

    def __init__(self, rows: int, columns: int, row_height: float, *, gap: float) -> None:
        self._row_height, self._gap = row_height, gap
        self._width = (draw.WIDTH - _LEFT - _RIGHT - (columns - 1) * _BETWEEN) / columns
        self._height = rows * row_height + (rows - 1) * gap + _TOP + _BOTTOM
        self.figure = Figure(figsize=(draw.WIDTH, self._height))
        self.axes = self.figure.add_axes((0.0, 0.0, 1.0, 1.0))
        self.axes.set_axis_off()
        self.axes.set(xlim=(0.0, draw.WIDTH), ylim=(0.0, self._height))

    def panel(
        self, row: int, column: int, x: tuple[float, float], y: tuple[float, float], *, logarithmic: bool = False
    ) -> Panel:
        """Return the panel in a row and column with its ranges of values."""
        left = _LEFT + column * (self._width + _BETWEEN)
        top = self._height - _TOP - row * (self._row_height + self._gap)
        return Panel(
            self, Scale(*x, left, left + self._width, logarithmic), Scale(*y, top - self._row_height, top, logarithmic)
        )

    def key(self, column: int, names: Iterable[str]) -> None:
        """Say above a column which curve is which."""
        lines = [Line2D([], [], label=name, **draw.LINES[name]) for name in names]
        right = _LEFT + column * (self._width + _BETWEEN) + self._width
        place = (right / draw.WIDTH, 1.0)
        # Each column has a legend of its own, which `axes.legend` would replace by the next.
        self.figure.legend(handles=lines, loc="upper right", bbox_to_anchor=place, ncols=len(lines), borderaxespad=0.1)
