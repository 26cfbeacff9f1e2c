"""Which numbers decide?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kbs_process.report import draw
from kbs_process.report.panel import Block, Figure, Grid, Panel, Picture, Text
from kbs_process.report.prose import Prose
from kbs_process.report.provenance import constants
from kbs_process.report.tables import Tables
from kbs_process.report.text import label, measure, number, percent, unit
from kbs_process.studies.flight.results import Driver, FlightRequirement, FlightResults

_SAYS = Prose("kbs_process.studies.flight", "drivers")
_DRIVERS = 16


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
        picture = _drivers(found, results.by_chance, requirement)
        blocks.append(
            Figure(f"What drives the {requirement.statistic}: {requirement.name}", (picture,), _SAYS.caption("drivers"))
        )
        rows = tuple(
            (driver.name, measure(driver.value, driver.sigma), unit(driver.unit), percent(driver.share))
            for driver in found
        )
        head = ("Number", "Value ± sigma", "Unit", "Share of variance")
        blocks.append(Grid(f"Drivers: {requirement.name}", head, rows, "krkr"))
    blocks.append(constants(results.parameters))
    return Panel("drivers", "Drivers", question, tuple(blocks))


def _drivers(found: Sequence[Driver], chance: float, requirement: FlightRequirement) -> Picture:
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
