"""One pass over an MCAP file: every chunk verified, everything unreadable counted, located and passed over.

The file is read front to back, never by its index: so a damaged index misleads nobody, chunks cannot
overlap, and the work is proportional to the file's size. Where a record's frame is broken, reading
resumes at the next chunk (or message outside a chunk) that is consistent in itself.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from kbs_process.ingest import framing as mcap
from kbs_process.ingest.compression import LARGEST, Decompressor
from kbs_process.ingest.framing import MalformedError
from kbs_process.ingest.kernels import PADDING, Bytes, Words, walk
from kbs_process.signals.records import Loss

WINDOW = 1 << 22  # bytes read at a time
CANDIDATE = re.compile(rb"(?=([\x05\x06]).{5}\x00\x00\x00)", re.DOTALL)  # a chunk or message below 2^40 bytes
OPCODE, CHANNEL, LOG, AT, SIZE = range(5)  # columns of the rows that `walk` returns


@dataclass(frozen=True, slots=True, eq=False)
class Segment:
    """Messages in one buffer, which holds until the next segment is asked for."""

    buffer: Bytes
    rows: Words  # (n, 5): OPCODE, CHANNEL, LOG, AT, SIZE


class Container:
    """The segments of one file, and what was lost on the way."""

    def __init__(self, path: Path, dictionary: mcap.Dictionary, origin: int | None) -> None:
        self.path = path
        self.size = path.stat().st_size
        self.dictionary = dictionary
        self.losses: list[Loss] = []
        self.origin = origin  # log time of the recording's first message, ns: zero of the losses' times
        self._last: int | None = None
        self._decompress = Decompressor()
        self._buffer = np.zeros(WINDOW + PADDING, dtype=np.uint8)
        self._at = 0  # in the file, of the buffer's first byte
        self._left = 0  # bytes carried over from the window before
        self._loose = False  # the file has messages outside chunks

    def lose(
        self, kind: str, detail: str, *, count: int = 1, start: int | None = None, end: int | None = None
    ) -> None:
        """Note a loss; `start` and `end` are log times in ns."""
        self.losses.append(Loss(kind, self.path.name, count, self.seconds(start), self.seconds(end), detail))

    def seconds(self, log: int | None) -> float | None:
        """Return a log time in s since the recording's first message."""
        return None if log is None or self.origin is None else (log - self.origin) / 1e9

    def segments(self) -> Iterator[Segment]:
        """Yield the messages of the file, in its order."""
        with self.path.open("rb") as file:
            self._seek(file, len(mcap.MAGIC))
            while (stop := self._fill(file)) > 0:
                rows = walk(self._buffer, np.uint64(0), np.uint64(stop))
                end, rows = int(rows[-1, AT]), rows[:-1]
                ends = np.flatnonzero((rows[:, OPCODE] == mcap.DATA_END_OP) & (rows[:, SIZE] == 4))
                if len(ends):
                    rows = rows[: ends[0]]
                yield from self._window(rows)
                if len(ends):
                    return
                if end == 0:
                    self._oversized(file, stop)
                else:
                    self._carry(end, stop)
        self._truncated(self._at, b"")

    # The window over the file

    def _seek(self, file: BinaryIO, at: int) -> None:
        file.seek(at)
        self._at, self._left = at, 0

    def _fill(self, file: BinaryIO) -> int:
        """Read on behind the bytes carried over; return how many the buffer holds."""
        room = memoryview(self._buffer)[self._left : len(self._buffer) - PADDING]  # type: ignore[arg-type]
        return self._left + file.readinto(room)  # type: ignore[attr-defined, no-any-return]

    def _carry(self, end: int, stop: int) -> None:
        self._left = stop - end
        self._buffer[: self._left] = self._buffer[end:stop].copy()
        self._at += end

    def _oversized(self, file: BinaryIO, stop: int) -> None:
        """Deal with a first record that does not fit the window: too long, cut off, or none at all."""
        head = self._buffer[: min(stop, mcap.CHUNK_HEAD_MAX + mcap.RECORD_HEAD.size)].tobytes()
        if stop < mcap.RECORD_HEAD.size:
            self._truncated(self._at, head)
            self._seek(file, self.size)
            return
        opcode, length = mcap.RECORD_HEAD.unpack_from(head)
        end = self._at + mcap.RECORD_HEAD.size + length
        if end > self.size or (opcode == mcap.MESSAGE_OP and length < 22):
            self._resume(file, head)
        elif stop == len(self._buffer) - PADDING and length <= LARGEST:
            self._buffer = np.zeros(mcap.RECORD_HEAD.size + length + PADDING, dtype=np.uint8)
            self._seek(file, self._at)
        elif stop < len(self._buffer) - PADDING:
            self._truncated(self._at, head)  # the file has become shorter meanwhile
            self._seek(file, self.size)
        else:
            self._pass_over(file, opcode, length)
            self._seek(file, end)

    def _pass_over(self, file: BinaryIO, opcode: int, length: int) -> None:
        """Check an attachment that is too large for memory; anything else of that size is lost."""
        if opcode != mcap.ATTACHMENT_OP:
            self.lose("undecodable", f"a record of {length} bytes at byte {self._at}")
            return
        file.seek(self._at + mcap.RECORD_HEAD.size)
        crc, left = 0, length - 4
        while left and (piece := file.read(min(left, WINDOW))):
            crc, left = zlib.crc32(piece, crc), left - len(piece)
        self._check_attachment(crc, int.from_bytes(file.read(4), "little"))

    # Records

    def _window(self, rows: Words) -> Iterator[Segment]:
        opcodes = rows[:, OPCODE]
        others = np.flatnonzero(opcodes != mcap.MESSAGE_OP)
        first = 0
        for i in others:
            if opcodes[i] == mcap.CHUNK_OP:
                yield from self._loose_messages(rows[first:i])
                first = int(i)
                yield from self._chunk(self._content(self._buffer, rows[i]))
            else:
                self._record(int(opcodes[i]), rows[i])
        yield from self._loose_messages(rows[first:])

    def _loose_messages(self, rows: Words) -> Iterator[Segment]:
        messages = rows[rows[:, OPCODE] == mcap.MESSAGE_OP]
        if len(messages):
            self._loose = True
            yield self._segment(self._buffer, messages)

    def _segment(self, buffer: Bytes, messages: Words) -> Segment:
        if self.origin is None:
            self.origin = int(messages[0, LOG])
        self._last = int(messages[-1, LOG])
        return Segment(buffer, messages)

    @staticmethod
    def _content(buffer: Bytes, row: Words) -> memoryview:
        at = int(row[AT])
        return memoryview(buffer)[at : at + int(row[SIZE])]  # type: ignore[arg-type]

    def _record(self, opcode: int, row: Words) -> None:
        """Check a record that is no message and no chunk, and learn schemas and channels from it."""
        content = self._content(self._buffer, row)
        place = self._at + int(row[AT])
        try:
            if opcode in (mcap.SCHEMA_OP, mcap.CHANNEL_OP):
                self.dictionary.add(opcode, bytes(content))
            elif opcode == mcap.MESSAGE_INDEX_OP:
                mcap.parse_message_index(bytes(content))
            elif opcode == mcap.ATTACHMENT_OP:
                crc = int.from_bytes(content[-4:], "little")
                self._check_attachment(zlib.crc32(content[:-4]), crc)
            elif opcode == mcap.HEADER_OP and place != len(mcap.MAGIC) + mcap.RECORD_HEAD.size:
                raise MalformedError("a second header")
            elif opcode not in (mcap.HEADER_OP, mcap.METADATA_OP) and opcode < mcap.PRIVATE_OP:
                raise MalformedError(f"opcode {opcode} does not belong there")
        except MalformedError as error:
            self.lose("undecodable", f"record at byte {place}: {error}")

    def _check_attachment(self, crc: int, expected: int) -> None:
        if expected not in (0, crc):
            self.lose("crc", "an attachment's CRC is wrong")

    def _chunk(self, content: memoryview) -> Iterator[Segment]:
        """Verify, decompress and walk a chunk; a bad one is lost as a whole."""
        try:
            head = mcap.parse_chunk_head(bytes(content[: mcap.CHUNK_HEAD_MAX]), len(content))
        except MalformedError as error:
            self.lose("undecodable", f"chunk: {error}", start=self._last)
            return
        span = {"start": head.start, "end": head.end}
        try:
            buffer = self._decompress(head.compression, content[head.at :], head.size)
        except MalformedError as error:
            self.lose("undecodable", f"chunk: {error}", **span)
            return
        if head.crc and zlib.crc32(memoryview(buffer)[: head.size]) != head.crc:  # type: ignore[arg-type]
            self.lose("crc", "chunk with a wrong CRC", **span)
            return
        rows = walk(buffer, np.uint64(0), np.uint64(head.size))
        end, rows = int(rows[-1, AT]), rows[:-1]
        if end != head.size:
            self.lose("undecodable", f"chunk: its last {head.size - end} bytes are no records", **span)
        loose = rows[:, OPCODE] == mcap.MESSAGE_OP
        for row in rows[~loose]:
            try:
                self.dictionary.add(int(row[OPCODE]), bytes(self._content(buffer, row)))
            except MalformedError as error:
                self.lose("undecodable", f"record in a chunk: {error}", **span)
        if loose.any():
            yield self._segment(buffer, rows if loose.all() else rows[loose])

    # Damage

    def _resume(self, file: BinaryIO, head: bytes) -> None:
        """Go on at the next consistent chunk or loose message, or end the pass as truncated."""
        broken = self._at
        for place in self._candidates(file, broken + 1):
            if self._consistent(file, place):
                self.lose(
                    "undecodable",
                    f"{place - broken} bytes from byte {broken} are no records",
                    start=self._last,
                )
                self._seek(file, place)
                return
        self._truncated(broken, head)
        self._seek(file, self.size)

    def _candidates(self, file: BinaryIO, at: int) -> Iterator[int]:
        while at < self.size:
            file.seek(at)
            piece = file.read(WINDOW)
            for match in CANDIDATE.finditer(piece):
                if match[1] == b"\x06" or self._loose:
                    yield at + match.start()
            if at + len(piece) >= self.size:
                return
            at += len(piece) - mcap.RECORD_HEAD.size + 1

    def _consistent(self, file: BinaryIO, at: int) -> bool:
        """Whether a chunk at `at` agrees with itself, or a message there with what follows it."""
        file.seek(at)
        head = file.read(mcap.RECORD_HEAD.size + mcap.CHUNK_HEAD_MAX)
        opcode, length = mcap.RECORD_HEAD.unpack_from(head)
        end = at + mcap.RECORD_HEAD.size + length
        if end > self.size:
            return False
        if opcode == mcap.CHUNK_OP:
            try:
                chunk = mcap.parse_chunk_head(head[mcap.RECORD_HEAD.size :], length)
            except MalformedError:
                return False
            return chunk.compression in ("", "zstd", "lz4")
        channel = int.from_bytes(head[mcap.RECORD_HEAD.size :][:2], "little")
        if length < 22 or channel not in self.dictionary.channels:
            return False
        file.seek(end)
        follower = file.read(mcap.RECORD_HEAD.size)
        if len(follower) < mcap.RECORD_HEAD.size:
            return not follower
        opcode, length = mcap.RECORD_HEAD.unpack(follower)
        return bool(opcode <= mcap.DATA_END_OP and length <= self.size - end - mcap.RECORD_HEAD.size)

    def _truncated(self, at: int, head: bytes) -> None:
        """Note that the file ends without its end mark, `self.size - at` bytes of it unread."""
        if any(loss.kind == "truncated" for loss in self.losses):
            return
        end = None
        if len(head) >= mcap.RECORD_HEAD.size + mcap.CHUNK_HEAD.size and head[0] == mcap.CHUNK_OP:
            end = mcap.CHUNK_HEAD.unpack_from(head, mcap.RECORD_HEAD.size)[1]
        self.lose(
            "truncated", f"{self.size - at} bytes unread; the file was not closed", start=self._last, end=end
        )
