"""MCAP files for the tests, by the `mcap` library: the independent engine that the reader is compared with."""

from __future__ import annotations

import io
import struct
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType, Writer

MAGIC = b"\x89MCAP0\r\n"


def rewrite(source: Path, target: Path, *, compression: CompressionType, **options: Any) -> None:
    """Copy a file's messages into another with other options of `mcap.writer.Writer`."""
    with source.open("rb") as file, target.open("wb") as out:
        writer = Writer(out, compression=compression, **options)
        writer.start(profile="ros2", library="test")
        channels: dict[int, int] = {}
        for schema, channel, message in make_reader(file).iter_messages(log_time_order=False):
            if channel.id not in channels:
                assert schema is not None
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, number
                )
            writer.add_message(
                channels[channel.id], message.log_time, message.data, message.publish_time, message.sequence
            )
        writer.finish()


def build(
    messages: Iterable[tuple[int, bytes]],
    *,
    schema: tuple[str, str, bytes],
    encoding: str,
    topic: str = "/topic",
    compression: CompressionType = CompressionType.ZSTD,
    **options: Any,
) -> bytes:
    """Return a file with one topic and the messages (log time, payload)."""
    out = io.BytesIO()
    writer = Writer(out, compression=compression, **options)
    writer.start()
    channel = writer.register_channel(topic, encoding, writer.register_schema(*schema))
    for sequence, (log, payload) in enumerate(messages):
        writer.add_message(channel, log, payload, log, sequence)
    writer.finish()
    return out.getvalue()


def top_records(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield (opcode, offset of the record, its whole length) of every record of a file."""
    at = len(MAGIC)
    while at < len(data) - len(MAGIC):
        opcode, length = struct.unpack_from("<BQ", data, at)
        yield opcode, at, 9 + length
        at += 9 + length


NO_INDEX = IndexType.NONE
