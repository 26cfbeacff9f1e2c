"""An MCAP file that is being written, many messages at a time: of `mcap` only the records, for its writer takes
messages one by one, which costs ten times as much.
"""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from typing import BinaryIO

import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Schema,
    Statistics,
    SummaryOffset,
)
from numpy.typing import NDArray

from kbs_process.recordings.mcap.checksum import crc32
from kbs_process.recordings.mcap.framing import (
    CHANNEL_OP,
    CHUNK_INDEX_OP,
    FOOTER,
    FOOTER_OP,
    MAGIC,
    MESSAGE_INDEX_OP,
    MESSAGE_OP,
    RECORD_HEAD,
    SCHEMA_OP,
    STATISTICS_OP,
)

_COMPRESSION = "zstd"
_INDEX_HEAD = struct.Struct("<BQHI")
_MESSAGE_HEAD = np.dtype("u1, <u8, <u2, <u4, <i8, <i8")  # opcode, length, channel, sequence, log and publish time

Whole = NDArray[np.int64]


def records(channel: int, first: int, log: Whole, publish: Whole, payloads: NDArray[np.uint8]) -> list[bytes]:
    """Return the record of each message of a channel; `payloads` (n, size), `first` is the first sequence number."""
    length = _MESSAGE_HEAD.itemsize - RECORD_HEAD.size + payloads.shape[1]
    table = np.empty(len(payloads), [("head", _MESSAGE_HEAD), ("payload", np.uint8, payloads.shape[1:])])
    values = MESSAGE_OP, length, channel, first + np.arange(len(payloads)), log, publish
    for field, value in zip(_MESSAGE_HEAD.names or (), values, strict=True):
        table["head"][field] = value
    table["payload"] = payloads
    rows: list[bytes] = table.view(f"V{table.itemsize}").tolist()
    return rows


class OutFile:
    """The file: it takes channels, then their messages in the order that they are to have."""

    def __init__(self, file: BinaryIO, profile: str, chunk: int) -> None:
        self._file, self._chunk, self._crc = file, chunk, 0
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._chunks: list[ChunkIndex] = []
        self._counts = Counter[int]()
        self._data = bytearray()  # of the next chunk
        self._index: list[Whole] = []  # of its messages: channel, log time and place in it
        self._put(MAGIC + _packed(Header(profile, "kbs-process")))

    def register(self, topic: str, kind: str, definition: bytes) -> int:
        """Return the number of a new channel for messages of a ROS 2 type in CDR."""
        number = len(self._channels) + 1
        self._schemas.append(Schema(id=number, data=definition, encoding="ros2msg", name=kind))
        self._channels.append(Channel(number, topic, "cdr", {}, number))
        self._data += _packed(self._schemas[-1], self._channels[-1])
        return number

    def add(self, channel: Whole, log: Whole, messages: Sequence[bytes]) -> None:
        """Add messages, by their `records`; a chunk ends with the one that reaches beyond its size."""
        ends = np.cumsum([0, *map(len, messages)])
        start = 0
        while start < len(messages):
            place = len(self._data) - ends[start] + ends
            stop = max(start + 1, min(len(messages), int(np.searchsorted(place, self._chunk, side="right"))))
            self._index.append(np.stack([channel[start:stop], log[start:stop], place[start:stop]]))
            self._data += b"".join(messages[start:stop])
            start = stop
            if len(self._data) > self._chunk:
                self._close_chunk()

    def finish(self) -> None:
        """Write what is left, and the summary."""
        self._close_chunk()
        self._put(_packed(DataEnd(self._crc)))
        statistics = Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=len(self._chunks),
            message_count=self._counts.total(),
            message_end_time=max((one.message_end_time for one in self._chunks), default=0),
            message_start_time=min((one.message_start_time for one in self._chunks), default=0),
            metadata_count=0,
            schema_count=len(self._schemas),
        )
        operations = SCHEMA_OP, CHANNEL_OP, STATISTICS_OP, CHUNK_INDEX_OP
        groups = [_packed(*group) for group in (self._schemas, self._channels, [statistics], self._chunks)]
        places = list(pairwise(np.cumsum([self._file.tell(), *map(len, groups)]).tolist()))
        offsets = [SummaryOffset(op, at, end - at) for op, (at, end) in zip(operations, places, strict=True)]
        summary = b"".join([*groups, _packed(*offsets)])
        footer = RECORD_HEAD.pack(FOOTER_OP, FOOTER.size) + FOOTER.pack(places[0][0], places[-1][1], 0)[:-4]
        self._put(summary + _packed(Footer(places[0][0], places[-1][1], crc32(footer, crc32(summary)))) + MAGIC)

    def _close_chunk(self) -> None:
        if not self._index:
            return
        channel, log, place = np.concatenate(self._index, axis=1)
        data, start = bytes(self._data), self._file.tell()
        first, last, compressed = int(log.min()), int(log.max()), zstandard.compress(data)
        self._put(_packed(Chunk(_COMPRESSION, compressed, last, first, crc32(data), len(data))))
        end = self._file.tell()
        offsets = {}
        for number in dict.fromkeys(channel.tolist()):
            offsets[number] = self._file.tell()
            entries = np.stack([log, place], axis=1)[channel == number].tobytes()
            self._put(_INDEX_HEAD.pack(MESSAGE_INDEX_OP, len(entries) + 6, number, len(entries)) + entries)
        index = self._file.tell() - end
        self._chunks.append(
            ChunkIndex(end - start, start, _COMPRESSION, len(compressed), last, index, offsets, first, len(data))
        )
        self._counts.update(channel.tolist())
        self._data.clear()
        self._index.clear()

    def _put(self, data: bytes) -> None:
        self._crc = crc32(data, self._crc)
        self._file.write(data)


def _packed(*records: McapRecord) -> bytes:
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]
