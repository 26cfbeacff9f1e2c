"""Payloads of the messages that are written, in each encoding."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from kbs_process.recordings.mcap.messages.schemas import Kind, delimited, number_field
from kbs_process.signals.records import Array, Stamps

Encoding = Literal["ros2", "json", "protobuf"]
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
    encoding: Encoding = "ros2"
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


def payloads(stream: OutStream) -> Iterator[bytes]:
    """Yield the payload of every message."""
    encoders = {"ros2": _ros2, "json": _json, "protobuf": _protobuf}
    return encoders[stream.encoding](stream)


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


def _ros2(stream: OutStream) -> Iterator[bytes]:
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
    return map(bytes, layout.rows(len(stream.stamp)))


def _json(stream: OutStream) -> Iterator[bytes]:
    encode = msgspec.json.Encoder().encode
    joints = len(stream.names)
    for stamp, row in zip(stream.stamp.tolist(), stream.values.tolist(), strict=True):
        seconds, nanoseconds = divmod(stamp, 1_000_000_000)
        message: dict[str, Any] = {
            "header": {"stamp": {"sec": seconds, "nanosec": nanoseconds}, "frame_id": stream.frame}
        }
        if stream.kind == "wrench":
            force, torque = (dict(zip("xyz", part, strict=True)) for part in (row[:3], row[3:]))
            message["wrench"] = {"force": force, "torque": torque}
        elif stream.kind == "joints":
            message |= {"name": stream.names, "position": row[:joints], "velocity": row[joints : 2 * joints]}
            if len(row) > 2 * joints:
                message["effort"] = row[2 * joints :]
        else:
            message["temperature"] = row[0]
        yield encode(message)


def _protobuf(stream: OutStream) -> Iterator[bytes]:
    joints = len(stream.names)
    names = b"".join(delimited(2, name.encode()) for name in stream.names)
    frame = delimited(2, stream.frame.encode()) if stream.frame else b""
    for stamp, row in zip(stream.stamp.tolist(), stream.values.tolist(), strict=True):
        seconds, nanoseconds = divmod(stamp, 1_000_000_000)
        time = number_field(1, seconds) + number_field(2, nanoseconds)
        header = delimited(1, delimited(1, time) + frame)
        if stream.kind == "wrench":
            yield header + delimited(2, delimited(1, _doubles(1, row[:3])) + delimited(2, _doubles(1, row[3:])))
        elif stream.kind == "joints":
            parts = (row[:joints], row[joints : 2 * joints], row[2 * joints :])
            yield (header + names + b"".join(_packed(number, part) for number, part in enumerate(parts, start=3)))
        else:
            yield header + _doubles(2, row)


def _doubles(first: int, values: list[float]) -> bytes:
    """Encode numbered doubles; proto3 leaves out a zero, though not a negative one."""
    return b"".join(
        bytes((number << 3 | 1,)) + data
        for number, value in enumerate(values, start=first)
        if any(data := struct.pack("<d", value))
    )


def _packed(number: int, values: list[float]) -> bytes:
    return delimited(number, struct.pack(f"<{len(values)}d", *values)) if values else b""
