"""The tables of a reference day."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kbs_process.mission.planner import Plan
from kbs_process.results.tables import write_table
from kbs_process.signals.records import Array, Mask, Signal
from kbs_process.studies.reference_day.day import TORQUES, Assessed

MODES = ("tracking", "zenith", "hand-over", "pre-pointing")  # codes in the table of the trajectory


def write_tables(folder: Path, planned: Plan, found: Assessed) -> None:
    """Write trajectory, pointing errors and torques of the day."""
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
