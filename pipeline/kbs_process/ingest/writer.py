"""Writing MCAP: deterministic, in the order of log times, and read again before it counts as written."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from heapq import merge
from pathlib import Path
from typing import BinaryIO

import numpy as np
from mcap.writer import CompressionType, Writer

from kbs_process.errors import OutputError
from kbs_process.ingest.encoding import OutStream, payloads
from kbs_process.ingest.schemas import TYPES, json_schema, protobuf_name, protobuf_schema, ros2_schema
from kbs_process.ingest.source import open_recording
from kbs_process.ingest.streams import Stream
from kbs_process.signals.records import Block

CHUNK = 1 << 20  # bytes, uncompressed


def write_mcap(path: Path, streams: Sequence[OutStream]) -> None:
    """Write the streams to `path` in one step: it holds all of them, verified, or what it held before.

    The same streams give the same bytes. Raises `OutputError` where the file cannot be written, or does not
    give back what was written to it.
    """
    if len({stream.topic for stream in streams}) != len(streams):
        raise ValueError("two streams of one topic")
    streams = [_sorted(stream) for stream in streams]
    draft = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with draft.open("wb") as file:
            _write(file, streams)
            file.flush()
            os.fsync(file.fileno())
        _verify(draft, streams)
        draft.replace(path)
    except OSError as error:
        raise OutputError(f"cannot be written: {error.strerror}", where=str(path)) from error
    finally:
        draft.unlink(missing_ok=True)


def _sorted(stream: OutStream) -> OutStream:
    order = np.argsort(stream.log, kind="stable")
    return OutStream(
        stream.topic,
        stream.kind,
        stream.stamp[order],
        stream.log[order],
        stream.values[order],
        stream.names,
        stream.encoding,
        stream.frame,
    )


def _write(file: BinaryIO, streams: Sequence[OutStream]) -> None:
    writer = Writer(file, chunk_size=CHUNK, compression=CompressionType.ZSTD, enable_data_crcs=True)
    ros2 = all(stream.encoding == "ros2" for stream in streams)
    writer.start(profile="ros2" if ros2 else "", library="kbs-process")
    channels = [_register(writer, stream) for stream in streams]
    for log, number, stamp, sequence, payload in merge(*(_messages(i, s) for i, s in enumerate(streams))):
        writer.add_message(channels[number], log, payload, publish_time=stamp, sequence=sequence)
    writer.finish()  # type: ignore[no-untyped-call]


def _register(writer: Writer, stream: OutStream) -> int:
    kind = stream.kind
    if stream.encoding == "ros2":
        schema = writer.register_schema(TYPES[kind], "ros2msg", ros2_schema(kind))
    elif stream.encoding == "json":
        schema = writer.register_schema(TYPES[kind], "jsonschema", json_schema(kind))
    else:
        schema = writer.register_schema(protobuf_name(kind), "protobuf", protobuf_schema())
    return writer.register_channel(
        stream.topic, "cdr" if stream.encoding == "ros2" else stream.encoding, schema
    )


def _messages(number: int, stream: OutStream) -> Iterator[tuple[int, int, int, int, bytes]]:
    """Yield (log, stream, stamp, sequence, payload); in the order of log times."""
    rows = zip(stream.log.tolist(), stream.stamp.tolist(), payloads(stream), strict=True)
    for sequence, (log, stamp, payload) in enumerate(rows):
        yield log, number, stamp, sequence, payload


def _verify(path: Path, streams: Sequence[OutStream]) -> None:
    """Read the file and compare every number with what was to be written."""
    source = open_recording(path)
    wanted = {stream.topic: stream for stream in streams}
    done = dict.fromkeys(wanted, 0)
    for topic, block in source.read([Stream(s.topic, s.topic, s.fields) for s in streams]):
        first = done[topic]
        done[topic] += len(block)
        if not _same(block, wanted[topic], slice(first, done[topic])):
            raise OutputError(f"{topic} does not read back as it was written", where=str(path))
    short = [topic for topic, stream in wanted.items() if done[topic] != len(stream.stamp)]
    lost = [loss for loss in source.losses if loss.kind not in ("non-finite", "missing field")]
    if short or lost:
        raise OutputError(
            f"reads back with losses: {short or lost}", where=str(path), remedy="check the disk"
        )


def _same(block: Block, stream: OutStream, part: slice) -> bool:
    return (
        np.array_equal(block.stamp, stream.stamp[part])
        and np.array_equal(block.log, stream.log[part])
        and np.array_equal(block.values, stream.values[part], equal_nan=True)
    )
