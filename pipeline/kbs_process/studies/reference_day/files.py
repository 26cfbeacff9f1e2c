"""The tables of a reference day."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kbs_process.mission.planner import Plan
from kbs_process.results.tables import write_table
from kbs_process.signals.records import Array, Mask, Signal
from kbs_process.studies.reference_day.day import Assessed
from kbs_process.studies.reference_day.flying import TORQUES
from kbs_process.studies.reference_day.units import Units

MODES = ("tracking", "zenith", "hand-over", "pre-pointing")  # codes in the table of the trajectory


def write_tables(folder: Path, planned: Plan, found: Assessed, units: Units) -> None:
    """Write trajectory, pointing errors and torques of the day, and what each unit reached."""
    codes = np.empty(len(planned.t))
    for phase in planned.phases:
        codes[phase.start : phase.end] = MODES.index(phase.mode)
    write_table(
        folder / "tables" / "day" / "trajectory.parquet",
        {"t": planned.t, "az": planned.q[:, 0], "el": planned.q[:, 1], "offset": planned.offset, "mode": codes},
        {"t": "s", "az": "rad", "el": "rad", "offset": "rad", "mode": "1"},
        frame="T",
        history=("desired angles at every cycle", "mode: " + ", ".join(MODES)),
    )
    _write(folder, "error", found.error)
    _write(folder, "boresight", found.boresight)
    for band, signal in found.torques.items():
        _write(folder, f"torque.{band}", signal, TORQUES)
    if units.reached:
        _units(folder, units)


def _units(folder: Path, units: Units) -> None:
    """Write one row a unit: what was drawn, and the figures of each section."""
    columns = {number.name: units.drawn[:, column] for column, number in enumerate(units.numbers)}
    named = {}
    for i, section in enumerate(units.reached[0].sections):
        for j, axis in enumerate(section.axes):
            name = f"{section.name}.{axis.axis}.percentile"
            columns[name] = np.array([one.sections[i].axes[j].percentile for one in units.reached])
            named[name] = "rad"
        for j, torque in enumerate(section.torques):
            name = f"{section.name}.torque.{torque.band}"
            columns[name] = np.array([one.sections[i].torques[j].value for one in units.reached])
            named[name] = "N m"
    write_table(folder / "tables" / "day" / "units.parquet", columns, named)


def _write(folder: Path, stem: str, signal: Signal, channels: tuple[str, ...] = ()) -> None:
    columns: dict[str, Array | Mask] = {"t": signal.t, "valid": signal.valid}
    columns |= {name: signal.column(name) for name in channels or signal.channels}
    units = dict(zip(signal.channels, signal.units, strict=True))
    write_table(
        folder / "tables" / "day" / f"{stem}.parquet",
        columns,
        {"t": "s"} | {name: units[name] for name in columns if name in units},
        frame=signal.frame,
        history=signal.history,
    )
