"""Recordings damaged as real ones are: cut short, a bit flipped, samples that are no numbers, a clock set back."""

from __future__ import annotations

import io
import struct
from collections.abc import Callable
from pathlib import Path

from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from recordings.mcap.mcap_files import top_records

CHUNK = 6
STAMP = struct.Struct("<iI")  # of a ROS 2 header, behind the encapsulation's four bytes
ENCAPSULATION = 4


def cut_short(path: Path, share: float) -> None:
    """Leave the first part of a file, as a recorder that lost power does."""
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])


def flip_a_bit(path: Path, chunk: int) -> tuple[int, int]:
    """Flip one bit amid a chunk's compressed content; return first and last log time (ns) of the chunk."""
    data = bytearray(path.read_bytes())
    at, length = [(at, length) for opcode, at, length in top_records(bytes(data)) if opcode == CHUNK][chunk]
    start, end = struct.unpack_from("<QQ", data, at + 9)
    data[at + length // 2] ^= 0x10
    path.write_bytes(data)
    return start, end


def alter(path: Path, topic: str, change: Callable[[float, bytes], bytes]) -> None:
    """Change messages of a topic: `change` takes the time (s) since the recording's first message, and the payload."""
    first = None
    with io.BytesIO(path.read_bytes()) as file, path.open("wb") as out:
        writer = Writer(out, compression=CompressionType.ZSTD)
        writer.start(profile="ros2", library="test")
        channels: dict[int, int] = {}
        for schema, channel, message in make_reader(file).iter_messages(log_time_order=False):
            if channel.id not in channels:
                assert schema is not None
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, number)
            first = message.log_time if first is None else first
            t = (message.log_time - first) * 1e-9
            data = change(t, message.data) if channel.topic == topic else message.data
            writer.add_message(channels[channel.id], message.log_time, data, message.publish_time)
        writer.finish()


def with_last_number(payload: bytes, value: float) -> bytes:
    """A payload whose last float64 is `value`: Tz of a wrench."""
    return payload[:-8] + struct.pack("<d", value)


def with_earlier_stamp(payload: bytes, seconds: int) -> bytes:
    """A payload whose sensor stamp is `seconds` earlier."""
    s, ns = STAMP.unpack_from(payload, ENCAPSULATION)
    return payload[:ENCAPSULATION] + STAMP.pack(s - seconds, ns) + payload[ENCAPSULATION + STAMP.size :]
