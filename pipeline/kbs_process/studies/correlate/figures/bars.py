"""Bars: values against a limit, signal against noise, shares of a variance, fitted parameters."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from kbs_process.report import draw
from kbs_process.report.panel import Picture
from kbs_process.report.text import label, number, unit
from kbs_process.studies.correlate.results import Budget, ChannelResult, FittedParameter, Repeatability, Requirement

_ROWS = 24  # of parameters in one column


def against_limit(requirement: Requirement, alt: str) -> Picture:
    """Draw each channel's measured value with its 95 % interval, the predicted one, and the limit."""
    rows = requirement.channels
    with draw.style():
        figure, axis = draw.canvas(0.75 + 0.36 * len(rows))
        place = np.arange(len(rows), dtype=float)
        axis.barh(
            place - 0.19,
            [row.value or 0.0 for row in rows],
            0.34,
            xerr=_reach(rows),
            color=draw.MEASURED,
            error_kw={"elinewidth": 0.9, "capsize": 2, "ecolor": draw.INK},
            label="measured, 95 % interval",
        )
        if any(row.predicted is not None for row in rows):
            axis.barh(
                place + 0.19, [row.predicted or 0.0 for row in rows], 0.34, color=draw.PREDICTED, label="predicted"
            )
        axis.axvline(requirement.limit, color=draw.LIMIT, linewidth=1.2, label="limit")
        axis.set_yticks(place, [label(row.channel) for row in rows])
        axis.invert_yaxis()
        axis.set_xlim(left=0.0)
        axis.grid(visible=False, axis="y")
        axis.set_xlabel(f"{requirement.statistic} / {unit(requirement.unit)}")
        _legend_above(figure)
        return draw.picture(figure, alt)


def _reach(rows: Sequence[ChannelResult]) -> list[list[float]]:
    """How far each channel's interval reaches below and above its value; not at all where there is none."""
    values = [row.value or 0.0 for row in rows]
    lows = [value if row.low is None else row.low for value, row in zip(values, rows, strict=True)]
    highs = [value if row.high is None else row.high for value, row in zip(values, rows, strict=True)]
    return [
        [value - low for value, low in zip(values, lows, strict=True)],
        [high - value for value, high in zip(values, highs, strict=True)],
    ]


def signal_and_noise(rows: Sequence[Repeatability], alt: str, title: str) -> Picture:
    """Draw rms of signal and of noise of every channel, on a logarithmic axis."""
    with draw.style():
        figure, axis = draw.canvas(0.8 + 0.3 * len(rows))
        place = np.arange(len(rows), dtype=float)
        for values, offset, color, name in (
            ([row.signal_rms or np.nan for row in rows], -0.18, draw.MEASURED, "signal"),
            ([row.noise_rms or np.nan for row in rows], 0.18, draw.RESIDUAL, "noise"),
        ):
            axis.barh(place + offset, values, 0.34, color=color, label=name)
        found = [value for row in rows for value in (row.signal_rms, row.noise_rms) if value]
        draw.logarithmic(axis, "x", 0.5 * min(found, default=0.1), 1.5 * max(found, default=1.0))
        axis.set_yticks(place, [f"{label(row.channel)} / {unit(row.unit)}" for row in rows])
        axis.invert_yaxis()
        axis.grid(visible=False, axis="y")
        axis.set_xlabel("rms, in the channel's unit")
        _legend_above(figure)
        return draw.picture(figure, alt, title)


def variance_shares(budgets: Sequence[Budget], alt: str) -> Picture:
    """Draw each stage's share of each channel's variance; the total stands beside the bar."""
    stages = list(dict.fromkeys(item.stage for budget in budgets for item in budget.contributions))
    with draw.style():
        figure, axis = draw.canvas(0.95 + 0.34 * len(budgets))
        for row, budget in enumerate(budgets):
            variance = sum(item.sigma**2 for item in budget.contributions) or 1.0
            left = 0.0
            for item in budget.contributions:
                share = 100.0 * item.sigma**2 / variance
                color = draw.SERIES[stages.index(item.stage) % len(draw.SERIES)]
                axis.barh(row, share, 0.62, left=left, color=color, edgecolor="white", linewidth=0.5)
                left += share
            axis.annotate(
                f"{number(budget.total, 2)} {unit(budget.unit)}", (101.0, row), va="center", annotation_clip=False
            )
        axis.set_yticks(range(len(budgets)), [label(budget.channel) for budget in budgets])
        axis.invert_yaxis()
        axis.set_xlim(0.0, 100.0)
        axis.grid(visible=False, axis="y")
        axis.set_xlabel("share of the variance / %          total σ at the bar's end")
        for index, stage in enumerate(stages):
            axis.bar(0, 0, color=draw.SERIES[index % len(draw.SERIES)], label=label(stage))
        _legend_above(figure)
        return draw.picture(figure, alt)


def shifts(parameters: Sequence[FittedParameter], alt: str) -> Picture:
    """Draw how far each fitted parameter moved from its prior, in the prior's sigma; many in two columns."""
    moved = [entry for entry in parameters if entry.prior is not None and entry.prior_sigma]
    columns = 1 if len(moved) <= _ROWS else 2
    rows = math.ceil(len(moved) / columns)
    prior = np.array([entry.prior for entry in moved], dtype=float)
    width = np.array([entry.prior_sigma for entry in moved], dtype=float)
    pull = (np.array([entry.value for entry in moved]) - prior) / width
    error = np.array([entry.sigma for entry in moved]) / width
    reach = max(3.0, 1.15 * float(np.max(np.abs(pull), initial=0.0)))
    with draw.style():
        figure = Figure(figsize=(draw.WIDTH, 0.7 + (0.2 if columns == 1 else 0.155) * rows), layout="constrained")
        axes = figure.subplots(1, columns, squeeze=False)[0]
        for column, axis in enumerate(axes):
            shown = slice(column * rows, min((column + 1) * rows, len(moved)))
            place = np.arange(shown.stop - shown.start, dtype=float)
            axis.axvspan(-2.0, 2.0, color=draw.SHADE, linewidth=0, label="prior, ± 2 σ")
            axis.errorbar(
                pull[shown],
                place,
                xerr=error[shown],
                fmt="o",
                markersize=3.5,
                color=draw.MEASURED,
                elinewidth=1.0,
                capsize=2,
                label="fitted, ± 1 σ",
            )
            axis.axvline(0.0, color=draw.RESIDUAL, linewidth=0.7)
            axis.set_yticks(place, [label(entry.name) for entry in moved[shown]])
            axis.set_ylim(rows - 0.5, -0.5)
            axis.set_xlim(-reach, reach)
            axis.grid(visible=False, axis="y")
            axis.set_xlabel("(fitted − prior) / prior's σ")
        handles, names = axes[0].get_legend_handles_labels()
        figure.legend(handles, names, loc="outside upper left", ncols=4, fontsize=7)
        return draw.picture(figure, alt, form="svg" if columns == 1 else "png")


def _legend_above(figure: Figure) -> None:
    figure.legend(loc="outside upper left", ncols=4, fontsize=7)
