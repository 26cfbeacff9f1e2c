"""Commands from a table: what a test engineer writes before there is a recording."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv as csv
import pyarrow.parquet as pq

from kbs_process.errors import RecordingError, did_you_mean
from kbs_process.plant.predict import Schedule
from kbs_process.signals.records import Array


def read_commands(path: Path, joints: tuple[str, ...]) -> Schedule:
    """Return the schedule in a CSV or Parquet file.

    Columns: `t` (s, increasing), for each joint its desired angle, called like the joint (rad) or `JOINT.deg`
    (degrees), and, where all of them are given, its desired rate `JOINT.rate` (rad/s); otherwise rates are differences
    of angles. Raises RecordingError that names the column, and for angles that look like degrees called radians: a run
    that starts beyond a turn.
    """
    table = _read(path)
    t = _column(table, "t", path)
    if len(t) < 2 or not (np.diff(t) > 0.0).all():
        raise RecordingError(
            "column 't' has fewer than two times, or they do not increase",
            where=str(path),
            remedy="sort the rows by time, and delete repeated ones",
        )
    position = np.stack([_angle(table, joint, path) for joint in joints], axis=1)
    names = [f"{joint}.rate" for joint in joints]
    if set(names) <= set(table.column_names):
        rate: Array = np.stack([_column(table, name, path) for name in names], axis=1)
    else:
        rate = np.gradient(position, t, axis=0)
    return Schedule(t=t, position=position, rate=rate)


def _angle(table: pa.Table, joint: str, path: Path) -> Array:
    degrees = f"{joint}.deg"
    if degrees in table.column_names:
        return np.radians(_column(table, degrees, path))
    angle = _column(table, joint, path)
    if abs(angle[0]) > 2.0 * np.pi:
        raise RecordingError(
            f"column '{joint}' starts at {angle[0]:g} rad, more than a turn away",
            where=str(path),
            remedy=f"give radians, or call the column '{degrees}' if these are degrees",
        )
    return angle


def _read(path: Path) -> pa.Table:
    try:
        return pq.read_table(path) if path.suffix == ".parquet" else csv.read_csv(path)
    except (pa.ArrowInvalid, OSError) as error:
        raise RecordingError(
            f"is not a table of commands: {error}", where=str(path), remedy="give a CSV file with a header, or Parquet"
        ) from error


def _column(table: pa.Table, name: str, path: Path) -> Array:
    if name not in table.column_names:
        raise RecordingError(f"has no column '{name}'", where=str(path), remedy=did_you_mean(name, table.column_names))
    try:
        column: Array = table[name].cast(pa.float64()).to_numpy()
    except pa.ArrowInvalid as error:
        raise RecordingError(f"column '{name}' is not numeric: {error}", where=str(path)) from error
    if not np.isfinite(column).all():
        row = int(np.flatnonzero(~np.isfinite(column))[0]) + 1
        raise RecordingError(
            f"column '{name}' is empty, NaN or infinite in row {row}", where=str(path), remedy="correct the row"
        )
    return column
