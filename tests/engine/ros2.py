"""ROS 2 messages by hand: definitions as recorders store them, CDR and JSON payloads."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator, Sequence

from engine.sensors import Stream

WRENCH_STAMPED = "geometry_msgs/msg/WrenchStamped"
JOINT_STATE = "sensor_msgs/msg/JointState"

_RULE = "=" * 80
_HEADER = f"""{_RULE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_RULE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""

DEFINITIONS = {
    WRENCH_STAMPED: f"""std_msgs/Header header
Wrench wrench
{_RULE}
MSG: geometry_msgs/Wrench
Vector3 force
Vector3 torque
{_RULE}
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
{_HEADER}""",
    JOINT_STATE: f"""std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
{_HEADER}""",
}

_TIME = {"type": "object", "properties": {"sec": {"type": "integer"}, "nanosec": {"type": "integer"}}}
_STAMPED = {"type": "object", "properties": {"stamp": _TIME, "frame_id": {"type": "string"}}}
_VECTOR = {"type": "object", "properties": {axis: {"type": "number"} for axis in "xyz"}}
_NUMBERS = {"type": "array", "items": {"type": "number"}}

JSON_SCHEMAS = {
    WRENCH_STAMPED: {
        "type": "object",
        "properties": {
            "header": _STAMPED,
            "wrench": {"type": "object", "properties": {"force": _VECTOR, "torque": _VECTOR}},
        },
    },
    JOINT_STATE: {
        "type": "object",
        "properties": {
            "header": _STAMPED,
            "name": {"type": "array", "items": {"type": "string"}},
            "position": _NUMBERS,
            "velocity": _NUMBERS,
            "effort": _NUMBERS,
        },
    },
}


class Cdr:
    """A little-endian CDR payload under construction; alignment counts from behind the 4-byte header."""

    def __init__(self) -> None:
        self._bytes = bytearray(b"\x00\x01\x00\x00")

    def _align(self, size: int) -> None:
        self._bytes += bytes(-(len(self._bytes) - 4) % size)

    def time(self, ns: int) -> None:
        """builtin_interfaces/Time."""
        self._align(4)
        self._bytes += struct.pack("<iI", *divmod(ns, 1_000_000_000))

    def length(self, count: int) -> None:
        """Length of a sequence or string."""
        self._align(4)
        self._bytes += struct.pack("<I", count)

    def string(self, text: str) -> None:
        """A string with its terminating zero."""
        encoded = text.encode() + b"\x00"
        self.length(len(encoded))
        self._bytes += encoded

    def doubles(self, numbers: Sequence[float]) -> None:
        """Consecutive float64, not preceded by their count."""
        if numbers:
            self._align(8)
            self._bytes += struct.pack(f"<{len(numbers)}d", *numbers)

    def sequence(self, numbers: Sequence[float]) -> None:
        """float64[]."""
        self.length(len(numbers))
        self.doubles(numbers)

    def done(self) -> bytes:
        """Return the payload."""
        return bytes(self._bytes)


def wrench_payloads(stream: Stream, frame_id: str, encoding: str) -> Iterator[bytes]:
    """Yield a WrenchStamped for each row Fx Fy Fz Tx Ty Tz; `encoding` is "cdr" or "json"."""
    for stamp, row in zip(stream.stamp.tolist(), stream.values.tolist(), strict=True):
        if encoding == "cdr":
            cdr = Cdr()
            cdr.time(stamp)
            cdr.string(frame_id)
            cdr.doubles(row)
            yield cdr.done()
        else:
            force, torque = (dict(zip("xyz", part, strict=True)) for part in (row[:3], row[3:]))
            wrench = {"force": force, "torque": torque}
            yield _json({"header": _stamp(stamp, frame_id), "wrench": wrench})


def joint_payloads(stream: Stream, names: Sequence[str], encoding: str) -> Iterator[bytes]:
    """Yield a JointState for each row: positions of all joints, then velocities where the row goes on."""
    joints = len(names)
    for stamp, row in zip(stream.stamp.tolist(), stream.values.tolist(), strict=True):
        position, velocity = row[:joints], row[joints:]
        if encoding == "cdr":
            cdr = Cdr()
            cdr.time(stamp)
            cdr.string("")
            cdr.length(joints)
            for name in names:
                cdr.string(name)
            for numbers in (position, velocity, ()):
                cdr.sequence(numbers)
            yield cdr.done()
        else:
            message = {"name": list(names), "position": position, "velocity": velocity, "effort": []}
            yield _json({"header": _stamp(stamp, "")} | message)


def _stamp(ns: int, frame_id: str) -> dict[str, object]:
    sec, nanosec = divmod(ns, 1_000_000_000)
    return {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": frame_id}


def _json(message: object) -> bytes:
    return json.dumps(message, separators=(",", ":")).encode()
