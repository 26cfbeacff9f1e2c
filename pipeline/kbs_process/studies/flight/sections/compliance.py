"""With which probability does a flight unit meet every requirement?"""

from __future__ import annotations

from kbs_process.report.panel import Block, Caption, Cell, Figure, Grid, Notices, Panel, Text
from kbs_process.report.tables import Tables
from kbs_process.report.text import MISSING, band_hz, count, frame_label, number, percent, unit
from kbs_process.studies.flight import figures
from kbs_process.studies.flight.results import Distribution, FlightRequirement, FlightResults

_SPREAD = Caption(
    shown="The share of the units that stay below each value, on every channel and for the greatest of them; the "
    "nominal unit (dots) and the limit.",
    good="All curves end left of the limit.",
    bad="A curve that crosses the limit: the share above it fails. Nominal units far from the middle of their curve: "
    "the statistic is not linear in the parameters, and the nominal unit must not be used alone.",
    do="Look below for the numbers that drive the spread, and have those measured on the flight motor-gear.",
)


def panel(results: FlightResults, tables: Tables) -> Panel:
    """Probabilities, the statistics behind them, and their distributions."""
    blocks: list[Block] = [_probabilities(results)]
    if results.warnings:
        blocks.append(Notices(tuple((n.severity, n.what, n.where, n.remedy) for n in results.warnings)))
    blocks.append(Text("Assumptions behind these figures:", results.notes))
    units = tables.read("flight", "units")
    for index, requirement in enumerate(results.requirements):
        title = f"{requirement.name}: {requirement.statistic} over {count(results.samples, 'unit')}"
        if units is not None:
            blocks.append(Figure(title, (figures.distribution(requirement, index, units),), _SPREAD))
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
    note = (
        f"{count(results.samples, 'unit')} drawn by Latin hypercube (seed {results.seed}), flown along "
        f"{results.trajectory} for {number(results.duration_s)} s. The bound holds 95 % of all units with 95 % "
        "confidence; probabilities have 95 % intervals. Statistic of the channel that is worst."
    )
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
