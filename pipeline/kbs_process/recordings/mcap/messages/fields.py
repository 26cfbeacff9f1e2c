"""Field paths: "wrench.force.x" is a number, "position[az]" an element by name, "data[3]" by place."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from kbs_process.errors import RecordingError, did_you_mean

Key = str | int
PATH = re.compile(r"(?P<path>\w+(?:\.\w+)*)(?:\[(?P<key>[^\[\]]+)\])?")
STAMPS = ("header.stamp", "stamp", "timestamp", "header.timestamp")  # where a message may carry its clock

NANOSECONDS = ("nanosec", "nsec", "nsecs", "nanos", "nanoseconds")


@dataclass(frozen=True, slots=True)
class Field:
    """A number that a message type has, or a sequence (`count` -1) or array of them; `named` by a sibling."""

    path: str
    count: int | None = None
    named: bool = False

    def __str__(self) -> str:
        return self.path if self.count is None else f"{self.path}[{'NAME' if self.named else 'INDEX'}]"


@dataclass(frozen=True, slots=True)
class Step:
    """A path taken apart: the number or sequence, and the element of the sequence."""

    path: str
    key: Key | None


@dataclass(frozen=True, slots=True)
class Elements:
    """What one message says of a sequence: the names of its elements, where it has any, and its length."""

    names: tuple[str, ...]
    count: int


def parse_path(path: str) -> Step:
    """Take a field path apart."""
    match = PATH.fullmatch(path)
    if match is None:
        raise RecordingError(
            f"'{path}' is no field path", remedy="write it like wrench.force.x, position[az] or data[3]"
        )
    key = match["key"]
    # No message has 10^18 elements; what is longer is a name.
    return Step(match["path"], int(key) if key is not None and key.isdecimal() and len(key) < 19 else key)


def resolve(paths: Sequence[str], fields: Sequence[Field], where: str) -> tuple[Step, ...]:
    """Return the steps of `paths`, all of which must be among a message type's `fields`."""
    known = {field.path: field for field in fields}
    steps = []
    for path in paths:
        step = parse_path(path)
        field = known.get(step.path)
        if field is None or (field.count is None) != (step.key is None):
            remedy = did_you_mean(path, [str(field) for field in fields])
            raise RecordingError(f"its messages have no number '{path}'", where=where, remedy=remedy)
        if isinstance(step.key, str) and not field.named:
            raise RecordingError(f"'{step.path}' has no names, only places", where=where, remedy=str(field))
        steps.append(step)
    return tuple(steps)


def find_stamp(fields: Sequence[Field], *others: str) -> tuple[str, ...]:
    """Return the paths of seconds and nanoseconds of the message's own stamp, none where it has none."""
    paths = {field.path for field in fields}
    for stamp in (*STAMPS, *others):
        seconds = [path for unit in ("sec", "secs", "seconds") if (path := f"{stamp}.{unit}") in paths]
        parts = [path for unit in NANOSECONDS if (path := f"{stamp}.{unit}") in paths]
        if seconds and parts:
            return seconds[0], parts[0]
    return ()


def sibling(path: str) -> str:
    """Return the path of the names that belong to the sequence at `path`."""
    return f"{path.rpartition('.')[0]}.name".lstrip(".")
