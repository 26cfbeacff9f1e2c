"""Commands before a test: of a table that a test engineer writes, or of a recording of the same trajectory."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv as csv
import pyarrow.parquet as pq

from kbs_process.campaign.config import Campaign
from kbs_process.errors import ConfigError, RecordingError, did_you_mean
from kbs_process.files import regular
from kbs_process.plant.predict import Schedule
from kbs_process.progress import Progress
from kbs_process.reduction.predicting import approached, schedule_of
from kbs_process.reduction.reading import read_run
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array, Run

LONGEST_S = 1e6  # that commands last
HOLE = 10.0  # times as long as between other rows
JUMP = 10.0  # times as fast as other rows, near by and on the whole


@dataclass(frozen=True, slots=True, eq=False)
class Commands:
    """A trajectory's commands, from time zero on."""

    name: str
    schedule: Schedule
    source: Path
    run: Run | None = None  # that they were recorded in
    slips: tuple[str, ...] = ()  # what may be meant otherwise

    @property
    def told(self) -> str:
        """What is run, for how long, and what of it may be a slip."""
        return "; ".join((f"{self.schedule.t[-1]:.4g} s of {self.name}", *self.slips))


def of_table(path: Path, rig: Rig) -> Commands:
    """Return the commands of a CSV or Parquet file."""
    schedule = read_commands(path, rig.joint_names)
    slips = tuple(_slips(schedule, rig.joint_names))
    return Commands(path.stem, replace(schedule, t=schedule.t - schedule.t[0]), path, slips=slips)


def of_trajectory(campaign: Campaign, trajectory: str | None, progress: Progress) -> Commands:
    """Return the commands of a trajectory's first recording (default: the trajectory listed last).

    Nothing else of it: before a test nobody knows what field and encoders will do.
    """
    first = {entry.trajectory: entry for entry in reversed(campaign.recordings)}
    name = trajectory or campaign.recordings[-1].trajectory
    if name not in first:
        raise ConfigError(f"there is no trajectory '{name}'", where=campaign.name, remedy=did_you_mean(name, first))
    entry = first[name]
    with progress.task(f"Reading {entry.name}"):
        run = read_run(campaign, entry)
    schedule = approached(replace(schedule_of(run, campaign.rig), field=None, encoder=None))
    return Commands(name, schedule, entry.path, run)


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
    if not t[-1] - t[0] <= LONGEST_S:
        raise RecordingError(
            f"column 't' lasts {t[-1] - t[0]:.3g} s",
            where=str(path),
            remedy=f"give seconds; commands may last {LONGEST_S:g} s",
        )
    position = np.stack([_angle(table, joint, path) for joint in joints], axis=1)
    names = [f"{joint}.rate" for joint in joints]
    if set(names) <= set(table.column_names):
        rate: Array = np.stack([_column(table, name, path) for name in names], axis=1)
    else:
        rate = np.gradient(position, t, axis=0)
    return Schedule(t=t, position=position, rate=rate)


def _slips(schedule: Schedule, joints: tuple[str, ...]) -> Iterator[str]:
    """Holes between rows that are even otherwise, and joints that move far within one row or two, in words."""
    t, steps = schedule.t, np.diff(schedule.t)
    holes = np.flatnonzero(steps > HOLE * np.median(steps))
    for row in holes[:1]:
        yield f"no commands from {t[row]:g} to {t[row + 1]:g} s{_more(len(holes))}: a straight line leads across"
    moves = np.abs(np.diff(schedule.position, axis=0))
    for joint, by in zip(joints, moves.T, strict=True):
        rate = by / steps
        near = np.pad(rate, 3)
        beside = np.max([near[:-6], near[1:-5], near[5:-1], near[6:]], axis=0)
        usual = np.median(rate[rate > 0.0]) if rate.any() else 0.0
        jumps = np.flatnonzero(rate > JUMP * np.maximum(beside, usual))
        for row in jumps[:1]:
            where = f"from {t[row]:g} to {t[row + 1]:g} s{_more(len(jumps))}"
            yield f"{joint} moves by {by[row]:.3g} rad {where}: {JUMP:g} times as fast as elsewhere"


def _more(count: int) -> str:
    return f", and {count - 1} times more" if count > 1 else ""


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
        regular(path)
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
