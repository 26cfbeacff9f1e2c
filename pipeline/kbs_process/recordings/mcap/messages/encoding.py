"""The messages that are written: their schemas and their payloads, in ROS 2's encoding, CDR."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from kbs_process.signals.records import Array, Stamps

Kind = Literal["wrench", "joints", "temperature"]

TYPES: dict[Kind, str] = {
    "wrench": "geometry_msgs/msg/WrenchStamped",
    "joints": "sensor_msgs/msg/JointState",
    "temperature": "sensor_msgs/msg/Temperature",
}

_HEADER = {
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
}
_ROS2: dict[Kind, dict[str, str]] = {
    "wrench": {
        "": "std_msgs/Header header\ngeometry_msgs/Wrench wrench",
        **_HEADER,
        "geometry_msgs/Wrench": "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque",
        "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    },
    "joints": {
        "": "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort",
        **_HEADER,
    },
    "temperature": {"": "std_msgs/Header header\nfloat64 temperature\nfloat64 variance", **_HEADER},
}
LITTLE_ENDIAN_CDR = b"\x00\x01\x00\x00"
WIDTHS = {"wrench": 6, "temperature": 1}
JOINT_PARTS = ("position", "velocity", "effort")


@dataclass(frozen=True, slots=True, eq=False)
class OutStream:
    """A topic to be written.

    Columns of `values`: a wrench's Fx, Fy, Fz, Tx, Ty, Tz (N, N m); a temperature (degC); for joints the
    position of each of `names` (rad; m of a prismatic joint), then, where they are known, the velocity of each (rad/s,
    m/s), then the effort of each (N m, N, or what it was recorded in).
    """

    topic: str
    kind: Kind
    stamp: Stamps  # (n,) sensor clock, ns
    log: Stamps  # (n,) recorder clock, ns
    values: Array  # (n, c)
    names: tuple[str, ...] = ()  # joints
    frame: str = ""  # frame_id

    def __post_init__(self) -> None:
        n, c = self.values.shape
        joints = len(self.names)
        widths = (WIDTHS[self.kind],) if self.kind in WIDTHS else (joints, 2 * joints, 3 * joints)
        if c not in widths or c == 0 or len(self.stamp) != n or len(self.log) != n:
            raise ValueError(
                f"{self.topic}: {n} x {c} values of kind {self.kind} with names {self.names}, "
                f"{len(self.stamp)} stamps and {len(self.log)} log times"
            )

    @property
    def fields(self) -> tuple[str, ...]:
        """The field paths of the columns, as a reader asks for them."""
        if self.kind == "wrench":
            return tuple(f"wrench.{part}.{axis}" for part in ("force", "torque") for axis in "xyz")
        if self.kind == "temperature":
            return ("temperature",)
        parts = JOINT_PARTS[: self.values.shape[1] // len(self.names)]
        return tuple(f"{part}[{name}]" for part in parts for name in self.names)


def ros2_schema(kind: Kind) -> bytes:
    """Return the definition with all those it depends on, as rosbag2 writes it."""
    main, *others = _ROS2[kind].items()
    text = main[1] + "\n" + "".join(f"{'=' * 80}\nMSG: {name}\n{body}\n" for name, body in others)
    return text.encode()


class _CdrLayout:
    """Lays out a CDR message field by field; every message of a stream has the same layout."""

    def __init__(self) -> None:
        self.size = len(LITTLE_ENDIAN_CDR)
        self.parts: list[tuple[int, str, Any]] = [(0, f"S{self.size}", LITTLE_ENDIAN_CDR)]

    def number(self, kind: str, values: Any) -> None:
        size = np.dtype(kind).itemsize
        self.size += -(self.size - len(LITTLE_ENDIAN_CDR)) % size
        self.parts.append((self.size, kind, values))
        self.size += size

    def text(self, text: str) -> None:
        data = text.encode() + b"\0"
        self.number("<u4", len(data))
        self.parts.append((self.size, f"S{len(data)}", data))
        self.size += len(data)

    def sequence(self, columns: Array) -> None:
        self.number("<u4", columns.shape[1])
        for column in columns.T:
            self.number("<f8", column)

    def rows(self, n: int) -> NDArray[np.uint8]:
        names = [f"f{i}" for i in range(len(self.parts))]
        offsets = [offset for offset, _, _ in self.parts]
        formats = [kind for _, kind, _ in self.parts]
        table = np.zeros(n, np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": self.size}))
        for name, (_, _, values) in zip(names, self.parts, strict=True):
            table[name] = values
        return table.view(np.uint8).reshape(n, self.size)


def payloads(stream: OutStream) -> NDArray[np.uint8]:
    """Return the payload (n, size) of every message."""
    layout = _CdrLayout()
    seconds, nanoseconds = np.divmod(stream.stamp, 1_000_000_000)
    layout.number("<i4", seconds)
    layout.number("<u4", nanoseconds)
    layout.text(stream.frame)
    if stream.kind == "joints":
        layout.number("<u4", len(stream.names))
        for name in stream.names:
            layout.text(name)
        joints = len(stream.names)
        for first in range(0, joints * len(JOINT_PARTS), joints):
            layout.sequence(stream.values[:, first : first + joints])  # none of a part that is not known
    else:
        for column in stream.values.T:
            layout.number("<f8", column)
        if stream.kind == "temperature":
            layout.number("<f8", 0.0)  # variance: unknown
    return layout.rows(len(stream.stamp))
