"""MCAP files for the tests, by the `mcap` library: an engine independent of the reader under test."""

from __future__ import annotations

import io
import struct
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from numpy.typing import NDArray

from kbs_process.recordings.mcap.source import open_recording
from kbs_process.recordings.mcap.streams import Stream
from kbs_process.signals.records import Block, Loss

MAGIC = b"\x89MCAP0\r\n"
FORCE = tuple(f"wrench.{part}.{axis}" for part in ("force", "torque") for axis in "xyz")


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
                channels[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, number)
            writer.add_message(
                channels[channel.id], message.log_time, message.data, message.publish_time, message.sequence
            )
        writer.finish()


def build(
    messages: Iterable[tuple[int, bytes]],
    schema: tuple[str, str, bytes],
    encoding: str,
    *,
    topic: str = "/topic",
    **options: Any,
) -> bytes:
    """Return a file with one topic and the messages (log time, payload)."""
    out = io.BytesIO()
    writer = Writer(out, **options)
    writer.start()
    channel = writer.register_channel(topic, encoding, writer.register_schema(*schema))
    for sequence, (log, payload) in enumerate(messages):
        writer.add_message(channel, log, payload, log, sequence)
    writer.finish()
    return out.getvalue()


def read(path: Path, *streams: Stream) -> tuple[dict[str, Block], tuple[Loss, ...]]:
    """Read the streams whole, each as one block, and the losses."""
    source = open_recording(path)
    blocks: dict[str, list[Block]] = {stream.key: [] for stream in streams}
    for key, block in source.read(streams):
        blocks[key].append(block)
    return {key: join(parts) for key, parts in blocks.items() if parts}, source.losses


def join(blocks: list[Block]) -> Block:
    """Return one block of many."""
    return Block(
        np.concatenate([block.stamp for block in blocks]),
        np.concatenate([block.log for block in blocks]),
        np.concatenate([block.values for block in blocks]),
    )


def top_records(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield (opcode, offset of the record, its whole length) of every record of a file."""
    at = len(MAGIC)
    while at < len(data) - len(MAGIC):
        opcode, length = struct.unpack_from("<BQ", data, at)
        yield opcode, at, 9 + length
        at += 9 + length


def same_bits(a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
    """Whether two arrays are equal to the last bit."""
    return a.shape == b.shape and np.ascontiguousarray(a).tobytes() == np.ascontiguousarray(b).tobytes()
