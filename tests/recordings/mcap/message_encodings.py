"""Recordings in encodings that the program reads and does not write: JSON and protobuf messages."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator, Sequence
from itertools import repeat
from pathlib import Path
from typing import Any, Literal

import msgspec
from mcap.writer import CompressionType, Writer

from kbs_process.recordings.mcap.messages.encoding import TYPES, Kind, OutStream
from kbs_process.recordings.mcap.writer import write_mcap

Encoding = Literal["ros2", "json", "protobuf"]
ENCODINGS: tuple[Encoding, ...] = ("ros2", "json", "protobuf")

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


def write_encoded(path: Path, streams: Sequence[OutStream], encoding: Encoding) -> None:
    """Write streams in the order of their log times, by the `mcap` library where the program has no such encoding."""
    if encoding == "ros2":
        write_mcap(path, streams)
        return
    payloads = {"json": _json, "protobuf": _protobuf}[encoding]
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=1 << 20, compression=CompressionType.ZSTD, enable_data_crcs=True)
        writer.start(library="test")
        messages = []
        for stream in streams:
            name, data = protobuf_name(stream.kind), protobuf_schema()
            if encoding == "json":
                name, data = TYPES[stream.kind], json_schema(stream.kind)
            schema = writer.register_schema(name, "jsonschema" if encoding == "json" else "protobuf", data)
            channel = writer.register_channel(stream.topic, encoding, schema)
            messages += zip(stream.log.tolist(), stream.stamp.tolist(), payloads(stream), repeat(channel))
        for log, stamp, payload, channel in sorted(messages, key=lambda message: message[0]):
            writer.add_message(channel, log, payload, publish_time=stamp)
        writer.finish()


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
