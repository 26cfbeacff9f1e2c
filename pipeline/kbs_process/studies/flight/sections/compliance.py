"""With which probability does a flight unit meet every requirement?"""

from __future__ import annotations

import numpy as np

from kbs_process.report import draw
from kbs_process.report.panel import Block, Cell, Figure, Grid, Panel, Picture, Text, notices
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Table, Tables
from kbs_process.report.text import MISSING, band_hz, count, frame_label, number, percent, unit
from kbs_process.studies.flight.results import Distribution, FlightRequirement, FlightResults

_SAYS = Prose("kbs_process.studies.flight", "compliance")


def panel(results: FlightResults, tables: Tables) -> Panel:
    """Probabilities, the statistics behind them, and their distributions."""
    assumptions = Text("Assumptions behind these figures:", results.notes)
    blocks: list[Block] = [_probabilities(results), *notices(results.warnings), assumptions]
    units = tables.read("flight", "units")
    for index, requirement in enumerate(results.requirements):
        title = f"{requirement.name}: {requirement.statistic} over {count(results.samples, 'unit')}"
        if units is not None:
            blocks.append(Figure(title, (_distribution(requirement, index, units),), _SAYS.caption("spread")))
        blocks.append(_statistics(requirement, title))
    return Panel(
        "compliance", "Compliance", "With which probability does a flight unit meet its requirements?", tuple(blocks)
    )


def _probabilities(results: FlightResults) -> Grid:
    rows = tuple(
        (
            f"{one.name} ({one.statistic}, {frame_label(one.frame)})",
            "" if one.quantity == "pointing" else band_hz(*one.band_Hz),
            f"{number(one.limit)} {unit(one.unit)}",
            f"{number(one.worst.nominal)} {unit(one.unit)}",
            f"{number(one.worst.q05)} to {number(one.worst.q95)} {unit(one.unit)}",
            _bound(one),
            f"{percent(one.meets.value)} ({percent(one.meets.low)} to {percent(one.meets.high)})",
        )
        for one in results.requirements
    )
    head = ("Requirement", "Band", "Limit", "Nominal", "90 % of units", "95 %/95 % bound", "Probability of meeting")
    note = _SAYS("table_note", results=results)
    return Grid("Compliance of the flight model", head, rows, "llrrrrr", note)


def _bound(one: FlightRequirement) -> Cell:
    bound = one.worst.bound
    if bound is None:
        return Cell(MISSING)
    return Cell(f"{number(bound)} {unit(one.unit)}", "pass" if bound <= one.limit else "fail")


def _statistics(requirement: FlightRequirement, title: str) -> Grid:
    def row(name: str, entry: Distribution) -> tuple[str, ...]:
        values = (entry.nominal, entry.mean, entry.q05, entry.median, entry.q95, entry.greatest)
        return (name, *(number(value) for value in values), number(entry.bound))

    rows = (*(row(entry.channel, entry) for entry in requirement.channels), row("worst of them", requirement.worst))
    head = ("Channel", "Nominal", "Mean", "5 %", "Median", "95 %", "Greatest", "95 %/95 % bound")
    return Grid(f"{title}, {unit(requirement.unit)}", head, rows, "krrrrrrr")


def _distribution(requirement: FlightRequirement, index: int, units: Table) -> Picture:
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
