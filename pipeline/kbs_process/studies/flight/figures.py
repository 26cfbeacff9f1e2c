"""Distributions over flight units, envelopes of their histories, and what drives the spread."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from kbs_process.report import draw
from kbs_process.report.panel import Picture
from kbs_process.report.tables import Table
from kbs_process.report.text import label, number, unit
from kbs_process.studies.flight.results import Driver, FlightRequirement

_DRIVERS = 16


def distribution(requirement: FlightRequirement, index: int, units: Table) -> Picture:
    """Draw the empirical distribution of each channel's statistic, the nominal unit, and the limit."""
    names = [channel.channel for channel in requirement.channels]
    columns = [units.columns[f"{index}.{name}.{requirement.statistic}"] for name in names]
    curves = [*zip(names, columns, requirement.channels, strict=True)]
    curves.append(("worst of them", np.max(columns, axis=0), requirement.worst))
    with draw.style():
        figure, axis = draw.canvas(2.6)
        for place, (name, outcomes, found) in enumerate(curves):
            color = draw.INK if place == len(curves) - 1 else draw.SERIES[place]
            ordered = np.sort(outcomes)
            share = np.arange(1, len(ordered) + 1) / len(ordered)
            axis.step(ordered, 100.0 * share, where="post", color=color, linewidth=1.1, label=name)
            at = 100.0 * float(np.mean(outcomes <= found.nominal))
            axis.plot([found.nominal], [at], marker="o", markersize=3.5, color=color)
        greatest = requirement.worst.greatest
        if greatest > 0.25 * requirement.limit:
            axis.axvline(requirement.limit, color=draw.LIMIT, linewidth=1.2, label="limit")
        axis.set_xlim(left=0.0)
        axis.set_ylim(0.0, 101.0)
        axis.set_xlabel(f"{requirement.statistic} / {unit(requirement.unit)}")
        axis.set_ylabel("units below / %")
        axis.legend(loc="lower right")
        alt = ", ".join(f"{entry.channel} {number(entry.q95)}" for entry in requirement.channels)
        return draw.picture(figure, f"Distributions over the units; 95 % stay below: {alt} {requirement.unit}")


def histories(requirement: FlightRequirement, table: Table) -> Picture:
    """Draw one row a channel: the nominal unit's envelope over the range of 90 % of the units."""
    t = table.columns["t"]
    rows = requirement.channels
    with draw.style():
        figure = Figure(figsize=(draw.WIDTH, 0.5 + 1.15 * len(rows)), layout="constrained")
        axes = np.atleast_1d(figure.subplots(len(rows), 1, sharex=True))
        for axis, row in zip(axes, rows, strict=True):
            low, high, q05, q95 = (table.columns[f"{row.channel}.{name}"] for name in ("low", "high", "q05", "q95"))
            axis.fill_between(t, q05, q95, color=draw.PREDICTED, alpha=0.5, linewidth=0.0, label="90 % of units")
            axis.fill_between(t, low, high, color=draw.MEASURED, linewidth=0.4, label="nominal unit")
            if row.greatest > 0.5 * requirement.limit:
                for level in (-requirement.limit, requirement.limit):
                    axis.axhline(level, color=draw.LIMIT, linewidth=0.8, linestyle=(0, (4, 2)))
            axis.set_ylabel(f"{row.channel} / {unit(requirement.unit)}")
        axes[0].legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
        axes[-1].set_xlabel("time / s")
        alt = f"{requirement.name}: range of 90 % of the units over time, and the nominal unit"
        return draw.picture(figure, alt, form="png")


def drivers(found: Sequence[Driver], chance: float, requirement: FlightRequirement) -> Picture:
    """Draw the share of the variance that each number explains, greatest first."""
    shown = found[:_DRIVERS]
    with draw.style():
        figure, axis = draw.canvas(0.7 + 0.2 * len(shown))
        place = np.arange(len(shown), dtype=float)
        axis.barh(place, [100.0 * driver.share for driver in shown], 0.65, color=draw.MEASURED)
        axis.axvline(100.0 * chance, color=draw.LIMIT, linewidth=0.9, linestyle=(0, (4, 2)))
        axis.set_yticks(place, [label(driver.name) for driver in shown])
        axis.invert_yaxis()
        axis.grid(visible=False, axis="y")
        axis.set_xlabel("share of the variance of ranks / %")
        said = ", ".join(f"{driver.name} {number(100.0 * driver.share)} %" for driver in shown)
        return draw.picture(figure, f"What drives {requirement.name}: {said}")
