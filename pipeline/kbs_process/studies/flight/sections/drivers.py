"""Which numbers decide?"""

from __future__ import annotations

from kbs_process.report.panel import Block, Caption, Figure, Grid, Panel, Text
from kbs_process.report.provenance import constants
from kbs_process.report.tables import Tables
from kbs_process.report.text import measure, percent, unit
from kbs_process.studies.flight import figures
from kbs_process.studies.flight.results import FlightResults

_CAPTION = Caption(
    shown="For each uncertain number the share of the variance (of ranks) that it explains over the units, alone; "
    "the line is what one of many numbers without any effect would exceed once in twenty times.",
    good="A few numbers far beyond the line, which together explain most of the spread.",
    bad="Hardly any beyond the line although units differ much: they act together, or phases do, and more units "
    "are needed to see it.",
    do="Measure the first ones on the flight motor-gear; the others may stay as they are.",
)


def panel(results: FlightResults, tables: Tables) -> Panel:
    """Bars and a table of the numbers that explain more than chance, then all parameters."""
    question = "Which uncertain numbers decide over the spread?"
    blocks: list[Block] = []
    for requirement in results.requirements:
        found = tuple(driver for driver in results.drivers if driver.requirement == requirement.name)
        if not found:
            line = f"{requirement.name}: no number explains more than {percent(results.by_chance)}, as chance would."
            blocks.append(Text(line))
            continue
        picture = figures.drivers(found, results.by_chance, requirement)
        blocks.append(Figure(f"What drives the {requirement.statistic}: {requirement.name}", (picture,), _CAPTION))
        rows = tuple(
            (driver.name, measure(driver.value, driver.sigma), unit(driver.unit), percent(driver.share))
            for driver in found
        )
        head = ("Number", "Value ± sigma", "Unit", "Share of variance")
        blocks.append(Grid(f"Drivers: {requirement.name}", head, rows, "krkr"))
    blocks.append(constants(results.parameters))
    return Panel("drivers", "Drivers", question, tuple(blocks))
