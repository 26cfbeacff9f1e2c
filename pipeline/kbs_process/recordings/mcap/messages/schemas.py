"""The message types that are written: their schemas in ROS 2's, protobuf's and JSON's own terms."""

from __future__ import annotations

import json
from typing import Any, Literal

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

# Field numbers count from 1 in the order given; "*" marks repeated fields.
_PROTOBUF: dict[str, tuple[str, ...]] = {
    "Time": ("int32 sec", "uint32 nanosec"),
    "Header": ("Time stamp", "string frame_id"),
    "Vector3": ("double x", "double y", "double z"),
    "Wrench": ("Vector3 force", "Vector3 torque"),
    "WrenchStamped": ("Header header", "Wrench wrench"),
    "JointState": ("Header header", "*string name", "*double position", "*double velocity", "*double effort"),
    "Temperature": ("Header header", "double temperature", "double variance"),
}
_SCALARS = {"double": 1, "int32": 5, "string": 9, "uint32": 13}  # FieldDescriptorProto.Type
_MESSAGE, _OPTIONAL, _REPEATED = 11, 1, 3


def ros2_schema(kind: Kind) -> bytes:
    """Return the definition with all those it depends on, as rosbag2 writes it."""
    main, *others = _ROS2[kind].items()
    text = main[1] + "\n" + "".join(f"{'=' * 80}\nMSG: {name}\n{body}\n" for name, body in others)
    return text.encode()


def protobuf_name(kind: Kind) -> str:
    """Return the full name of the protobuf message."""
    return f"kbs.{TYPES[kind].rpartition('/')[2]}"


def protobuf_schema() -> bytes:
    """Return a serialised FileDescriptorSet with every message type that is written."""
    messages = b"".join(delimited(4, _descriptor(name)) for name in _PROTOBUF)
    file = delimited(1, b"kbs.proto") + delimited(2, b"kbs") + messages + delimited(12, b"proto3")
    return delimited(1, file)


def _descriptor(name: str) -> bytes:
    fields = b""
    for number, member in enumerate(_PROTOBUF[name], start=1):
        kind, _, label = member.partition(" ")
        base = kind.lstrip("*")
        repeated = _REPEATED if kind.startswith("*") else _OPTIONAL
        field = delimited(1, label.encode()) + number_field(3, number) + number_field(4, repeated)
        field += number_field(5, _SCALARS.get(base, _MESSAGE))
        if base not in _SCALARS:
            field += delimited(6, f".kbs.{base}".encode())
        fields += delimited(2, field)
    return delimited(1, name.encode()) + fields


def varint(value: int) -> bytes:
    """Encode an integer to the base 128; negative ones as 64-bit two's complement."""
    value &= (1 << 64) - 1
    result = bytearray()
    while value > 0x7F:
        result.append(value & 0x7F | 0x80)
        value >>= 7
    result.append(value)
    return bytes(result)


def delimited(number: int, content: bytes) -> bytes:
    """Encode a field of bytes, text or a message."""
    return varint(number << 3 | 2) + varint(len(content)) + content


def number_field(number: int, value: int) -> bytes:
    """Encode an integer field; proto3 leaves out a zero."""
    return varint(number << 3) + varint(value) if value else b""


def json_schema(kind: Kind) -> bytes:
    """Return the JSON Schema of the message."""
    vector = _object({axis: _number() for axis in "xyz"})
    stamp = _object({"sec": {"type": "integer"}, "nanosec": {"type": "integer"}})
    header = _object({"stamp": stamp, "frame_id": {"type": "string"}})
    bodies: dict[Kind, dict[str, Any]] = {
        "wrench": {"wrench": _object({"force": vector, "torque": vector})},
        "joints": {
            "name": {"type": "array", "items": {"type": "string"}},
            "position": {"type": "array", "items": _number()},
            "velocity": {"type": "array", "items": _number()},
            "effort": {"type": "array", "items": _number()},
        },
        "temperature": {"temperature": _number()},
    }
    return json.dumps(_object({"header": header, **bodies[kind]}), separators=(",", ":")).encode()


def _object(properties: dict[str, Any]) -> dict[str, Any]:
    return {"type": "object", "properties": properties}


def _number() -> dict[str, Any]:
    return {"type": ["number", "null"]}
