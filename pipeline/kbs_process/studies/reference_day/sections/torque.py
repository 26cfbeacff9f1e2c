"""What torque does the unit exert on the spacecraft?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kbs_process.report import draw, series
from kbs_process.report.panel import Block, Figure, Grid, Panel, Picture
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Table, Tables
from kbs_process.report.text import MISSING, number
from kbs_process.studies.reference_day.results import ReferenceDayResults, Torque

_SAYS = Prose("kbs_process.studies.reference_day", "torque")
TORQUES = (("Tx", draw.MEASURED), ("Ty", draw.PREDICTED), ("Tz", draw.RESIDUAL))
_POINTS = 3000  # of a curve over the day
_SHOWN = 3  # causes of a torque, the strongest first


def panel(results: ReferenceDayResults, tables: Tables) -> Panel:
    """Histories in every band, and what is above them."""
    found: list[tuple[str, Table]] = []
    for torque in results.sections[0].torques:
        table = tables.read("day", f"torque.{torque.band}")
        if table is not None:
            found.append((torque.label, table))
    limits = [one.limit for one in results.requirements if one.unit == "N m"]
    blocks: list[Block] = []
    if found:
        picture = _torques(found, min(limits, default=None))
        blocks.append(Figure("Disturbance torque over the day", (picture,), _SAYS.caption("torque")))
    causes = tuple(_row(section.name, one) for section in results.sections for one in section.torques if one.cause)
    if causes:
        head = (
            "Section", "Band", "Greatest / N\u00a0m", "Axis", "Time / s", "Frequency / Hz", "Mode / Hz",
            "Rms / mN\u00a0m", "Rms without / mN\u00a0m",
        )  # fmt: skip
        blocks.append(Grid("Torque above the bands", head, causes, "klrlrrrrl", _SAYS("causes")))
    return Panel("torque", "Torque", "What torque does the unit exert on the spacecraft?", tuple(blocks))


def _row(section: str, one: Torque) -> tuple[str, ...]:
    assert one.cause is not None
    return (
        section,
        one.label,
        number(one.value, 2),
        one.axis,
        f"{one.time_s:.1f}",
        number(one.cause.frequency_Hz),
        number(one.cause.mode_Hz),
        number(1e3 * one.rms, 2),
        ", ".join(f"{left.name} {number(1e3 * left.value, 2)}" for left in one.cause.without[:_SHOWN]) or MISSING,
    )


def _torques(tables: Sequence[tuple[str, Table]], limit: float | None) -> Picture:
    """Draw every axis' torque over the day, a row a band: the range within each stretch of time."""
    with draw.style():
        figure, axes = draw.grid(0.4 + 1.6 * len(tables), len(tables), share_x=True)
        for axis, (name, table) in zip(axes, tables, strict=True):
            t = table.columns["t"]
            size = series.stride(len(t), _POINTS)
            t0, step = series.times(t, size)
            for column, color in TORQUES:
                x = series.envelope(np.where(table.valid, table.columns[column], np.nan), size)
                axis.plot(t0 + step * np.arange(len(x)), x, color=color, linewidth=0.4, label=column)
            if limit is not None and name == tables[0][0]:
                draw.limits(axis, -limit, limit)
            axis.set_ylabel(f"{name}\ntorque / N·m")
        axes[0].legend(loc="upper right", ncols=3)
        axes[-1].set_xlim(0.0, float(t[-1]))
        axes[-1].set_xlabel("time / s")
        return draw.picture(figure, "Disturbance torque at the spacecraft's centre of mass", form="png")
