"""Write a recording as an MCAP file, record by record: chunks by time, any compression level."""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import lz4.frame
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Message,
    MessageIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from engine.hardware import AXES
from engine.ros2 import DEFINITIONS, JOINT_STATE, JSON_SCHEMAS, WRENCH_STAMPED, joint_payloads, wrench_payloads
from engine.sensors import Recording

MAGIC = b"\x89MCAP0\r\n"
_ZSTD_LEVEL = 19


@dataclass(frozen=True, slots=True)
class Format:
    """How a file is written."""

    encoding: str = "cdr"  # or "json"
    compression: str = "zstd"  # or "lz4", or "" for none
    message_index: bool = True  # 16 bytes a message: a third of a small file
    chunk_s: float = 10.0
    kept: float = 1.0  # part of the file that a recorder without power leaves behind


class _Arrival(NamedTuple):
    log: int
    channel: int
    payload: bytes


def write(path: Path, recording: Recording, form: Format) -> None:
    """Write the recording's four topics in the order of their arrival. Equal input gives equal bytes."""
    topics = {
        "/transducer/wrench": WRENCH_STAMPED,
        "/encoder": JOINT_STATE,
        "/command": JOINT_STATE,
        "/motor/field": JOINT_STATE,
    }
    schemas = {name: _schema(id, name, form.encoding) for id, name in enumerate(DEFINITIONS, start=1)}
    channels = [
        Channel(id, topic, form.encoding, {}, schemas[kind].id)
        for id, (topic, kind) in enumerate(topics.items(), start=1)
    ]
    streams = (recording.wrench, recording.encoder, recording.command, recording.field)
    payloads = (
        wrench_payloads(streams[0], "transducer", form.encoding),
        *(joint_payloads(stream, AXES, form.encoding) for stream in streams[1:]),
    )
    arrivals: list[_Arrival] = []
    for channel, stream, messages in zip(channels, streams, payloads, strict=True):
        rows = zip(stream.log.tolist(), messages, strict=True)
        arrivals += [_Arrival(log, channel.id, payload) for log, payload in rows]
    arrivals.sort(key=lambda arrival: arrival[:2])
    content = _file(list(schemas.values()), channels, arrivals, form)
    path.write_bytes(content[: round(form.kept * len(content))])


def _schema(id: int, name: str, encoding: str) -> Schema:
    if encoding == "cdr":
        return Schema(id=id, data=DEFINITIONS[name].encode(), encoding="ros2msg", name=name)
    return Schema(id=id, data=json.dumps(JSON_SCHEMAS[name]).encode(), encoding="jsonschema", name=name)


def _file(schemas: list[Schema], channels: list[Channel], arrivals: list[_Arrival], form: Format) -> bytes:
    out = bytearray(MAGIC)
    out += _packed([Header(profile="ros2" if form.encoding == "cdr" else "", library="kbs engine")])
    indexes: list[ChunkIndex] = []
    declared = _packed([*schemas, *channels])  # the first chunk declares them, as recorders do
    for group in _by_time(arrivals, round(1e9 * form.chunk_s)):
        indexes.append(_append_chunk(out, declared, group, form))
        declared = b""
    out += _packed([DataEnd(data_section_crc=0)])

    summary_start = len(out)
    counts = {channel.id: sum(a.channel == channel.id for a in arrivals) for channel in channels}
    statistics = Statistics(
        attachment_count=0,
        channel_count=len(channels),
        channel_message_counts=counts,
        chunk_count=len(indexes),
        message_count=len(arrivals),
        message_end_time=arrivals[-1].log,
        message_start_time=arrivals[0].log,
        metadata_count=0,
        schema_count=len(schemas),
    )
    summary = bytearray()
    offsets: list[SummaryOffset] = []
    for opcode, records in (
        (Opcode.SCHEMA, schemas),
        (Opcode.CHANNEL, channels),
        (Opcode.STATISTICS, [statistics]),
        (Opcode.CHUNK_INDEX, indexes),
    ):
        packed = _packed(records)
        offsets.append(SummaryOffset(opcode, summary_start + len(summary), len(packed)))
        summary += packed
    offsets_start = summary_start + len(summary)
    summary += _packed(offsets)
    footer = struct.pack("<BQQQ", Opcode.FOOTER, 20, summary_start, offsets_start)
    crc = zlib.crc32(footer, zlib.crc32(summary))
    out += summary + _packed([Footer(summary_start, offsets_start, crc)]) + MAGIC
    return bytes(out)


def _by_time(arrivals: list[_Arrival], chunk_ns: int) -> Iterable[list[_Arrival]]:
    group: list[_Arrival] = []
    for arrival in arrivals:
        if group and arrival.log - group[0].log >= chunk_ns:
            yield group
            group = []
        group.append(arrival)
    yield group


def _append_chunk(out: bytearray, declared: bytes, group: list[_Arrival], form: Format) -> ChunkIndex:
    data = bytearray(declared)
    index: dict[int, list[tuple[int, int]]] = {}
    for arrival in group:
        index.setdefault(arrival.channel, []).append((arrival.log, len(data)))
        message = Message(arrival.channel, arrival.log, arrival.payload, arrival.log, sequence=0)
        data += _packed([message])
    compressed = _compressed(bytes(data), form.compression)
    start = len(out)
    out += _packed([Chunk(form.compression, compressed, group[-1].log, group[0].log, zlib.crc32(data), len(data))])
    length = len(out) - start
    offsets: dict[int, int] = {}
    index_start = len(out)
    if form.message_index:
        for channel, entries in sorted(index.items()):
            offsets[channel] = len(out)
            out += _packed([MessageIndex(channel, entries)])
    return ChunkIndex(
        chunk_length=length,
        chunk_start_offset=start,
        compression=form.compression,
        compressed_size=len(compressed),
        message_end_time=group[-1].log,
        message_index_length=len(out) - index_start,
        message_index_offsets=offsets,
        message_start_time=group[0].log,
        uncompressed_size=len(data),
    )


def _compressed(data: bytes, compression: str) -> bytes:
    if compression == "zstd":
        return zstandard.compress(data, level=_ZSTD_LEVEL)
    if compression == "lz4":
        return bytes(lz4.frame.compress(data, compression_level=lz4.frame.COMPRESSIONLEVEL_MAX))
    return data


def _packed(records: Iterable[object]) -> bytes:
    builder = RecordBuilder()
    for record in records:
        record.write(builder)  # type: ignore[attr-defined]
    return bytes(builder.end())
