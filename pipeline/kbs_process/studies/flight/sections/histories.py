"""When does the disturbance occur, and in how many units?"""

from __future__ import annotations

from kbs_process.report import draw
from kbs_process.report.panel import Block, Figure, Panel, Picture, Text
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Table, Tables
from kbs_process.report.text import band_hz, frame_label, unit
from kbs_process.studies.flight.results import FlightRequirement, FlightResults

_SAYS = Prose("kbs_process.studies.flight", "histories")


def panel(results: FlightResults, tables: Tables) -> Panel:
    """One figure a requirement."""
    blocks: list[Block] = []
    for index, requirement in enumerate(results.requirements):
        table = tables.read("flight", f"requirement_{index}")
        if table is not None:
            where = (band_hz(*requirement.band_Hz), frame_label(requirement.frame))
            title = ", ".join((requirement.name, *(() if requirement.quantity == "pointing" else where)))
            blocks.append(Figure(title, (_histories(requirement, table),), _SAYS.caption("histories")))
    return Panel(
        "histories",
        "Time histories",
        "When does the disturbance occur, and in how many units?",
        tuple(blocks) or (Text("The tables of the histories are not in this folder."),),
    )


def _histories(requirement: FlightRequirement, table: Table) -> Picture:
    """Draw one row a channel: the nominal unit's envelope over the range of 90 % of the units."""
    t = table.columns["t"]
    rows = requirement.channels
    with draw.style():
        figure, axes = draw.grid(0.5 + 1.15 * len(rows), len(rows), share_x=True)
        for axis, row in zip(axes, rows, strict=True):
            low, high, q05, q95 = (table.columns[f"{row.channel}.{name}"] for name in ("low", "high", "q05", "q95"))
            axis.fill_between(t, q05, q95, color=draw.PREDICTED, alpha=0.5, linewidth=0.0, label="90 % of units")
            axis.fill_between(t, low, high, color=draw.MEASURED, linewidth=0.4, label="nominal unit")
            if row.greatest > 0.5 * requirement.limit:
                draw.limits(axis, -requirement.limit, requirement.limit)
            axis.set_ylabel(f"{row.channel} / {unit(requirement.unit)}")
        axes[0].legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
        axes[-1].set_xlabel("time / s")
        alt = f"{requirement.name}: range of 90 % of the units over time, and the nominal unit"
        return draw.picture(figure, alt, form="png")
