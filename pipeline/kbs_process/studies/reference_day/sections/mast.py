"""What does a mast that yields make of torque and pointing?"""

from __future__ import annotations

import numpy as np

from kbs_process.report.panel import Grid, Panel
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Tables
from kbs_process.report.text import number
from kbs_process.studies.reference_day.results import ReferenceDayResults, Section

_SAYS = Prose("kbs_process.studies.reference_day", "mast")
_MDEG = 1e3 * 180.0 / np.pi


def panel(results: ReferenceDayResults, tables: Tables) -> Panel | None:
    """Its modes, and every section on it and on a rigid interface; nothing without a mast."""
    mast = results.mast
    if mast is None:
        return None
    modes = tuple(
        (str(place), _range(frequency), _range(damping))
        for place, (frequency, damping) in enumerate(zip(mast.frequency_Hz, mast.damping, strict=True), start=1)
    )
    labels = tuple(torque.label for torque in results.sections[0].torques[:-1])
    head = (
        "Section",
        *(f"{which} {label} / N\u00a0m" for label in labels for which in ("Rigid,", "On the mast,")),
        "Turn, cross-elevation / mdeg",
        "Turn, elevation / mdeg",
    )
    rows = tuple(_row(section) for section in results.sections)
    blocks = (
        Grid("Modes of the unit on its mast", ("Mode", "Frequency / Hz", "Damping of critical"), modes, "krr"),
        Grid("The day on the mast", head, rows, "k" + "r" * (len(head) - 1), _SAYS("day")),
    )
    return Panel("mast", "Mast", "What does the mast make of torque and pointing?", blocks)


def _row(section: Section) -> tuple[str, ...]:
    assert section.mast is not None
    pairs = zip(section.mast.rigid, section.torques, strict=False)
    return (
        section.name,
        *(number(x, 2) for rigid, torque in pairs for x in (rigid, torque.value)),
        number(_MDEG * section.mast.cross_elevation, 2),
        number(_MDEG * section.mast.elevation, 2),
    )


def _range(pair: tuple[float, float]) -> str:
    low, high = (number(x) for x in pair)
    return low if low == high else f"{low} to {high}"
