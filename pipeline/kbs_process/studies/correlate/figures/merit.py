"""Predicted against measured peaks: is the prediction pessimistic?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from kbs_process.report import draw
from kbs_process.report.panel import Picture
from kbs_process.report.text import label, unit
from kbs_process.studies.correlate.results import Merit

_MARKS = ("o", "s", "^", "D", "v", "P", "X", "*")


def peaks(rows: Sequence[Merit], alt: str) -> Picture:
    """Draw one mark a recording and channel, hollow where it is at the noise, axes for each unit."""
    units = list(dict.fromkeys(row.unit for row in rows))
    channels = list(dict.fromkeys(row.channel for row in rows))
    with draw.style():
        width = draw.WIDTH if len(units) > 1 else 4.2
        figure = Figure(figsize=(width, 3.1), layout="constrained")
        axes = figure.subplots(1, len(units), squeeze=False)[0]
        for axis, name in zip(axes, units, strict=True):
            shown = [row for row in rows if row.unit == name]
            measured = np.array([row.measured_peak for row in shown], dtype=float)
            predicted = np.array([row.predicted_peak for row in shown], dtype=float)
            low = 0.6 * float(min(measured.min(), predicted.min()))
            high = 1.6 * float(max(measured.max(), predicted.max()))
            axis.fill_between([low, high], [low, high], [high, high], color="#f4efe6", linewidth=0)
            axis.plot([low, high], [low, high], color=draw.RESIDUAL, linewidth=0.8)
            axis.text(0.03, 0.96, "pessimistic", transform=axis.transAxes, va="top", color="#8a6d3b")
            axis.text(0.97, 0.04, "optimistic", transform=axis.transAxes, ha="right", color=draw.LIMIT)
            for channel, noise in dict.fromkeys((row.channel, row.at_the_noise) for row in shown):
                mine = np.array([(row.channel, row.at_the_noise) == (channel, noise) for row in shown])
                index = channels.index(channel)
                color = draw.SERIES[index % len(draw.SERIES)]
                axis.plot(
                    measured[mine],
                    predicted[mine],
                    linestyle="none",
                    marker=_MARKS[index % len(_MARKS)],
                    markersize=4.5,
                    markerfacecolor="white" if noise else color,
                    markeredgecolor=draw.RESIDUAL if noise else color,
                    markeredgewidth=0.7,
                    label=f"{label(channel)}, at the noise" if noise else label(channel),
                )
            draw.logarithmic(axis, "x", low, high)
            draw.logarithmic(axis, "y", low, high)
            axis.set_xlabel(f"measured peak / {unit(name)}")
            axis.set_ylabel(f"predicted peak / {unit(name)}")
            axis.legend(loc="center left", bbox_to_anchor=(0.0, 0.62), fontsize=6.5)
        return draw.picture(figure, alt)
