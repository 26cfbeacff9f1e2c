"""An MCAP file being written: many messages at a time, in chunks, with indexes and a summary.

Byte for byte what the library `mcap` writes of one message after the other, at a tenth of its time.
Source: https://mcap.dev/spec
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable
from typing import Any, BinaryIO

import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, ChunkIndex, DataEnd, Footer, Header, Schema, Statistics, SummaryOffset
from numpy.typing import NDArray

from kbs_process.recordings.mcap.checksum import crc32
from kbs_process.recordings.mcap.messages.encoding import TYPES, OutStream, payloads, ros2_schema
from kbs_process.signals.records import Stamps

CHUNK = 1 << 20  # bytes, uncompressed
_MAGIC = b"\x89MCAP0\r\n"
_HEAD = np.dtype(
    [("opcode", "u1"), ("size", "<u8"), ("channel", "<u2"), ("sequence", "<u4"), ("log", "<u8"), ("stamp", "<u8")]
)
_FRAME = 9  # bytes: opcode and size


def message_records(stream: OutStream, channel: int, first: int) -> NDArray[np.uint8]:
    """The records (n, size) of a stream's messages, of which the first has the sequence number `first`."""
    content = payloads(stream)
    head = np.zeros(len(content), dtype=_HEAD)
    head["opcode"], head["size"] = Opcode.MESSAGE, _HEAD.itemsize - _FRAME + content.shape[1]
    head["channel"], head["sequence"] = channel, first + np.arange(len(content))
    head["log"], head["stamp"] = stream.log, stream.stamp
    return np.concatenate([head.view(np.uint8).reshape(len(content), _HEAD.itemsize), content], axis=1)


class ChunkedFile:
    """What is written, and what its summary will say of it."""

    def __init__(self, file: BinaryIO, profile: str) -> None:
        self._file = file
        self._crc = 0
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._indices: list[ChunkIndex] = []
        self._counts: dict[int, int] = {}
        self._begin()
        self._put(_MAGIC)
        self._put(_bytes([Header(profile, "kbs-process")]))

    def _begin(self) -> None:
        self._parts: list[bytes] = []
        self._size = 0
        self._messages: list[tuple[Stamps, Stamps, Stamps]] = []  # channel, log, offset

    def channel(self, stream: OutStream) -> int:
        """Declare a stream's topic; return its number."""
        number = len(self._channels) + 1
        schema = Schema(id=number, name=TYPES[stream.kind], encoding="ros2msg", data=ros2_schema(stream.kind))
        channel = Channel(id=number, topic=stream.topic, message_encoding="cdr", metadata={}, schema_id=number)
        self._schemas.append(schema)
        self._channels.append(channel)
        self._take(_bytes([schema, channel]))
        return number

    def add(self, channels: Stamps, log: Stamps, sizes: Stamps, records: NDArray[np.uint8]) -> None:
        """Add messages: channel, log time and record's size of each (n,), and all records end to end."""
        ends = np.cumsum(sizes)
        begin, done = 0, 0
        while begin < len(log):
            full = int(np.searchsorted(ends, CHUNK - self._size + done, side="right"))
            end = min(max(full, begin) + 1, len(log))
            these = slice(begin, end)
            self._messages.append((channels[these], log[these], (ends - sizes)[these] + (self._size - done)))
            self._take(records[done : ends[end - 1]].tobytes())
            begin, done = end, int(ends[end - 1])
            if self._size > CHUNK:
                self._finish_chunk()

    def finish(self) -> None:
        """Write what waits, and the summary."""
        self._finish_chunk()
        self._put(_bytes([DataEnd(self._crc)]))
        start = self._file.tell()
        summary, offsets = b"", []
        for opcode, records in (
            (Opcode.SCHEMA, self._schemas),
            (Opcode.CHANNEL, self._channels),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, self._indices),
            (Opcode.ATTACHMENT_INDEX, []),
            (Opcode.METADATA_INDEX, []),
        ):
            group = _bytes(records)
            offsets.append(SummaryOffset(opcode, start + len(summary), len(group)))
            summary += group
        at = start + len(summary)
        summary += _bytes(offsets)
        crc = zlib.crc32(struct.pack("<BQQQ", Opcode.FOOTER, 20, start, at), zlib.crc32(summary))
        self._file.write(summary + _bytes([Footer(start, at, crc)]) + _MAGIC)

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=len(self._indices),
            message_count=sum(self._counts.values()),
            message_end_time=max((one.message_end_time for one in self._indices), default=0),
            message_start_time=min((one.message_start_time for one in self._indices), default=0),
            metadata_count=0,
            schema_count=len(self._schemas),
        )

    def _take(self, records: bytes) -> None:
        self._parts.append(records)
        self._size += len(records)

    def _put(self, content: bytes) -> None:
        self._crc = crc32(content, self._crc)
        self._file.write(content)

    def _finish_chunk(self) -> None:
        if not self._messages:
            return
        content = b"".join(self._parts)
        packed = zstandard.compress(content)
        channels, log, offsets = (np.concatenate(column) for column in zip(*self._messages, strict=True))
        first, last = int(log.min()), int(log.max())
        chunk = _bytes([Chunk("zstd", packed, last, first, crc32(content), len(content))])
        start = self._file.tell()
        self._put(chunk)
        index, places = b"", {}
        numbers, firsts = np.unique(channels, return_index=True)
        for number in numbers[np.argsort(firsts)].tolist():
            own = channels == number
            places[number] = self._file.tell() + len(index)
            pairs = np.stack([log[own], offsets[own]], axis=1).astype("<u8").tobytes()
            index += struct.pack("<BQHI", Opcode.MESSAGE_INDEX, 6 + len(pairs), number, len(pairs)) + pairs
            self._counts[number] = self._counts.get(number, 0) + int(np.count_nonzero(own))
        self._put(index)
        about: Any = {
            "chunk_length": len(chunk),
            "chunk_start_offset": start,
            "compression": "zstd",
            "compressed_size": len(packed),
            "message_end_time": last,
            "message_index_length": len(index),
            "message_index_offsets": places,
            "message_start_time": first,
            "uncompressed_size": len(content),
        }
        self._indices.append(ChunkIndex(**about))
        self._begin()


def _bytes(records: Iterable[Any]) -> bytes:
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    content: bytes = builder.end()  # type: ignore[no-untyped-call]
    return content
