"""When does the disturbance come, and in how many units?"""

from __future__ import annotations

from kbs_process.report.panel import Block, Caption, Figure, Panel, Text
from kbs_process.report.tables import Tables
from kbs_process.report.text import band_hz, frame_label
from kbs_process.studies.flight import figures
from kbs_process.studies.flight.results import FlightResults

_CAPTION = Caption(
    shown="Least and greatest value in each stretch of time: of the nominal unit (dark), and the range that 90 % of "
    "the units stay in at that time (pale), in the requirement's band.",
    good="Bursts at the same times in all units, and all within the limits.",
    bad="A pale band much wider than the nominal unit's: where the burst falls depends on the unit, and one "
    "prediction says little.",
    do="If bursts come where a tooth-passing or cogging line crosses a resonance, choose rates that do not dwell "
    "there.",
)


def panel(results: FlightResults, tables: Tables) -> Panel:
    """One figure a requirement."""
    blocks: list[Block] = []
    for index, requirement in enumerate(results.requirements):
        table = tables.read("flight", f"requirement_{index}")
        if table is not None:
            where = (band_hz(*requirement.band_Hz), frame_label(requirement.frame))
            title = ", ".join((requirement.name, *(() if requirement.quantity == "pointing" else where)))
            blocks.append(Figure(title, (figures.histories(requirement, table),), _CAPTION))
    return Panel(
        "histories",
        "Time histories",
        "When does the disturbance come, and in how many units?",
        tuple(blocks) or (Text("The tables of the histories are not in this folder."),),
    )
