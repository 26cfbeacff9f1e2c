"""The tables of a flight prediction."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kbs_process.results.tables import write_table
from kbs_process.studies.flight.spread import Flight
from kbs_process.studies.flight.unit import Judged


def write_tables(folder: Path, flight: Flight) -> None:
    """Write a row a unit, and the histories of each requirement."""
    _units(folder, flight)
    for index, judged in enumerate(flight.judged):
        _histories(folder, flight, index, judged)


def _units(folder: Path, flight: Flight) -> None:
    """Write one row a unit: what was drawn, and its statistics."""
    columns = {number.name: flight.drawn[:, column] for column, number in enumerate(flight.numbers)}
    for index, judged in enumerate(flight.judged):
        for column, channel in enumerate(judged.channels):
            name = f"{index}.{channel}.{judged.requirement.statistic}"
            columns[name] = np.array([unit.statistics[index][column] for unit in flight.units])
    write_table(folder / "tables" / "flight" / "units.parquet", columns, {})


def _histories(folder: Path, flight: Flight, index: int, judged: Judged) -> None:
    """Write the nominal envelope, and between which values 90 % of the units lie, stretch by stretch."""
    nominal = flight.nominal.envelopes[index]
    every = np.stack([unit.envelopes[index] for unit in flight.units])  # (units, bins, 2, channels)
    low = np.quantile(every[:, :, 0], 0.05, axis=0)
    high = np.quantile(every[:, :, 1], 0.95, axis=0)
    columns = {"t": (np.arange(len(nominal)) + 0.5) * flight.duration_s / len(nominal)}
    for column, channel in enumerate(judged.channels):
        columns |= {
            f"{channel}.low": nominal[:, 0, column],
            f"{channel}.high": nominal[:, 1, column],
            f"{channel}.q05": low[:, column],
            f"{channel}.q95": high[:, column],
        }
    units = dict.fromkeys(columns, judged.unit) | {"t": "s"}
    path = folder / "tables" / "flight" / f"requirement_{index}.parquet"
    write_table(path, columns, units, frame=judged.frame)
