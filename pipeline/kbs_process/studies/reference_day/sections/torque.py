"""Which torque does the unit exert on the spacecraft?"""

from __future__ import annotations

from kbs_process.report.panel import Block, Caption, Figure, Panel
from kbs_process.report.tables import Table, Tables
from kbs_process.studies.reference_day import figures
from kbs_process.studies.reference_day.results import ReferenceDayResults

_TORQUE = Caption(
    shown="Torque at the spacecraft's centre of mass, every axis and band, as the range within each stretch of time.",
    good="Well within the limit (dashed) in the requirement's band.",
    bad="Bursts where the antenna crosses a rate at which cogging or tooth passing meets a resonance.",
    do="For a burst, find its rate in the trajectory: motor turns a second times 200 is the frequency.",
)


def panel(results: ReferenceDayResults, tables: Tables) -> Panel:
    """Histories in every band."""
    found: list[tuple[str, Table]] = []
    for torque in results.sections[0].torques:
        table = tables.read("day", f"torque.{torque.band}")
        if table is not None:
            found.append((torque.label, table))
    limits = [one.limit for one in results.requirements if one.unit == "N m"]
    blocks: list[Block] = []
    if found:
        picture = figures.torques(found, min(limits, default=None))
        blocks.append(Figure("Disturbance torque over the day", (picture,), _TORQUE))
    return Panel("torque", "Torque", "Which torque does the unit exert on the spacecraft?", tuple(blocks))
