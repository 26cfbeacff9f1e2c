"""One pass over an MCAP file: every chunk verified, everything unreadable counted, located and passed over.

The file is read front to back, never by its index: so a damaged index misleads nobody, chunks cannot
overlap, and the work is proportional to the file's size. Where a record's frame is broken, reading
resumes at the next chunk (or message outside a chunk) that is consistent in itself.
"""

from __future__ import annotations

import os
import re
from collections.abc import Generator, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from kbs_process.recordings.mcap import framing as mcap
from kbs_process.recordings.mcap.checksum import crc32
from kbs_process.recordings.mcap.compression import LARGEST, Decompressor
from kbs_process.recordings.mcap.framing import MalformedError
from kbs_process.recordings.mcap.kernels import Bytes, Words, walk
from kbs_process.signals.records import TRUNCATED, Loss

WINDOW = 1 << 20  # bytes read at a time: they stay in the processor's cache until used
CANDIDATE = re.compile(rb"(?=([\x05\x06]).{5}\x00\x00\x00)", re.DOTALL)  # a chunk or message below 2^40 bytes
MOST_ENTRIES = 1 << 17  # schemas and channels that one chunk may hold: all numbers there are
_APPLICATIONS = 8  # records of applications in a row, of which the last shows that the first is one
OPCODE, CHANNEL, LOG, AT, SIZE = range(5)  # rows of the table that `walk` returns


@dataclass(frozen=True, slots=True)
class Described:
    """A channel and its schema, as the file has described them up to the messages at hand."""

    number: int
    topic: str
    encoding: str
    schema: mcap.Schema
    metadata: bytes


class Segment:
    """Messages in one buffer, which is theirs alone; work and memory follow their number, not the file's channels."""

    def __init__(self, buffer: Bytes, table: Words, dictionary: mcap.Dictionary) -> None:
        self.buffer = buffer
        self.table = table  # (5, n): OPCODE, CHANNEL, LOG, AT, SIZE
        channels = table[CHANNEL].astype(np.uint16)
        self._order = np.argsort(channels, kind="stable")
        numbers, firsts, counts = np.unique(channels[self._order], return_index=True, return_counts=True)
        self._firsts = dict(zip(numbers.tolist(), firsts.tolist(), strict=True))
        self.counts: dict[int, int] = dict(zip(numbers.tolist(), counts.tolist(), strict=True))
        # Looked up here, as the dictionary grows while others use the segment.
        known = ((number, dictionary.channels.get(number)) for number in self.counts)
        self.channels = [
            Described(number, one.topic, one.encoding, dictionary.schema_of(one), one.metadata)
            for number, one in known
            if one
        ]

    def places(self, number: int) -> NDArray[np.int64]:
        """Return which columns of the table are the channel's."""
        first = self._firsts[number]
        return self._order[first : first + self.counts[number]]


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
        self._buffer = np.zeros(WINDOW, dtype=np.uint8)
        self._at = 0  # in the file, of the buffer's first byte
        self._left = 0  # bytes carried over from the window before
        self._crc: int | None = crc32(mcap.MAGIC)  # of all before the buffer; None where some was skipped
        self._loose = False  # the file has messages outside chunks

    def lose(self, kind: str, detail: str, *, count: int = 1, start: int | None = None, end: int | None = None) -> None:
        """Note a loss; `start` and `end` are log times in ns."""
        self.losses.append(Loss(kind, self.path.name, count, self.seconds(start), self.seconds(end), detail))

    def seconds(self, log: int | None) -> float | None:
        """Return a log time in s since the recording's first message."""
        return None if log is None or self.origin is None else (log - self.origin) / 1e9

    def segments(self) -> Generator[Segment]:
        """Yield the messages of the file, in its order."""
        with self.path.open("rb", buffering=0) as file:
            self._seek(file, len(mcap.MAGIC))
            while (stop := self._fill(file)) > 0:
                end, table = self._walk(self._buffer, stop, chunk=False)
                ends = np.flatnonzero((table[OPCODE] == mcap.DATA_END_OP) & (table[SIZE] >= 4))
                broken = not len(ends) and self._breaks(file, self._at + end)
                pushed = _last_of_applications(table) if broken else 0
                if pushed:  # what an application seems to have written leads to no record: no more is it one
                    end, table = int(table[AT, -pushed]) - mcap.RECORD_HEAD.size, table[:, :-pushed]
                yield from self._window(table[:, : ends[0]] if len(ends) else table, sure=not broken)
                if len(ends):
                    self._check_data_section(int(table[AT, ends[0]]))
                    return
                if end or pushed:
                    self._carry(end, stop)
                else:
                    self._oversized(file, stop)
                if pushed:
                    self._resume(file, self._head(stop - end))
        self._truncated(self._at, b"")

    @staticmethod
    def _walk(buffer: Bytes, stop: int, *, chunk: bool) -> tuple[int, Words]:
        """Return where the records in buffer[:stop] end, and their table."""
        table = walk(buffer, np.uint64(stop), chunk)
        return int(table[AT, -1]), table[:, :-1]

    # The window over the file

    def _seek(self, file: BinaryIO, at: int) -> None:
        file.seek(at)
        self._at, self._left = at, 0

    def _fill(self, file: BinaryIO) -> int:
        """Read on behind the bytes carried over; return how many the buffer holds."""
        room = memoryview(self._buffer)[self._left :]  # type: ignore[arg-type]
        return self._left + file.readinto(room)  # type: ignore[attr-defined, no-any-return]

    def _carry(self, end: int, stop: int) -> None:
        self._add_crc(self._buffer[:end])
        self._left = stop - end
        view = memoryview(self._buffer)  # type: ignore[arg-type]
        view[: self._left] = view[end:stop]  # unlike numpy's arrays, moved without a copy where they overlap
        self._at += end

    def _head(self, stop: int) -> bytes:
        """The beginning of the first record in the window, of so many bytes."""
        return self._buffer[: min(stop, mcap.CHUNK_HEAD_MAX + mcap.RECORD_HEAD.size)].tobytes()

    def _oversized(self, file: BinaryIO, stop: int) -> None:
        """Deal with a first record that does not fit the window: too long, cut off, or none at all."""
        head = self._head(stop)
        if stop < mcap.RECORD_HEAD.size:
            self._truncated(self._at, head)
            self._seek(file, self.size)
            return
        opcode, length = mcap.RECORD_HEAD.unpack_from(head)
        end = self._at + mcap.RECORD_HEAD.size + length
        if end > self.size or self._breaks(file, self._at):
            self._resume(file, head)
        elif stop == len(self._buffer) and length <= LARGEST:
            self._buffer = np.zeros(mcap.RECORD_HEAD.size + length, dtype=np.uint8)
            self._seek(file, self._at)
        elif stop < len(self._buffer):
            self._truncated(self._at, head)  # the file has become shorter meanwhile
            self._seek(file, self.size)
        else:
            self._pass_over(file, opcode, length)

    def _breaks(self, file: BinaryIO, at: int) -> bool:
        """Whether no record is at a byte of the file; one that is cut off, or not whole, may be.

        An application's record is one if another follows it, or the file ends there: a byte too many before it pushes
        a number's last byte to the place of an opcode, where it may look like an application's.
        """
        for _ in range(_APPLICATIONS):
            head = os.pread(file.fileno(), mcap.RECORD_HEAD.size, at)
            if len(head) < mcap.RECORD_HEAD.size:
                return False
            opcode, length = mcap.RECORD_HEAD.unpack(head)
            at += mcap.RECORD_HEAD.size + length
            if opcode < mcap.PRIVATE_OP:
                unknown = opcode == 0 or opcode > mcap.DATA_END_OP
                huge = length > LARGEST and at > self.size
                return bool(unknown or huge or (opcode == mcap.MESSAGE_OP and length < 22))
            if at > self.size:
                return True
        return False

    def _pass_over(self, file: BinaryIO, opcode: int, length: int) -> None:
        """Check an attachment that is too large for memory; anything else of that size is lost."""
        if opcode != mcap.ATTACHMENT_OP:
            self.lose("undecodable", f"a record of {length} bytes at byte {self._at}")
        file.seek(self._at)
        head = file.read(mcap.RECORD_HEAD.size + WINDOW)
        self._add_crc(head[: mcap.RECORD_HEAD.size])
        try:
            end = mcap.attachment_end(memoryview(head)[mcap.RECORD_HEAD.size :], length)
        except MalformedError as error:
            end = length
            if opcode == mcap.ATTACHMENT_OP:
                self.lose("undecodable", f"record at byte {self._at}: {error}")
        file.seek(self._at + mcap.RECORD_HEAD.size)
        crc = self._skip(file, end)
        tail = file.read(min(4, length - end))
        self._add_crc(tail)
        self._skip(file, length - end - len(tail))
        if opcode == mcap.ATTACHMENT_OP and tail:
            self._check_attachment(crc, int.from_bytes(tail, "little"))
        self._seek(file, self._at + mcap.RECORD_HEAD.size + length)

    def _skip(self, file: BinaryIO, size: int) -> int:
        """Read on over so many bytes, a piece at a time; return their CRC."""
        crc = 0
        while size and (piece := file.read(min(size, WINDOW))):
            crc, size = crc32(piece, crc), size - len(piece)
            self._add_crc(piece)
        return crc

    def _add_crc(self, piece: Bytes | bytes) -> None:
        if self._crc is not None:
            self._crc = crc32(piece, self._crc)

    def _check_data_section(self, at: int) -> None:
        """Check the CRC over all records before the one whose content begins at `at`, where there is one."""
        expected = int.from_bytes(self._buffer[at : at + 4].tobytes(), "little")
        self._add_crc(self._buffer[: at - mcap.RECORD_HEAD.size])
        if expected and self._crc not in (None, expected):
            self.lose("crc", "the data section's CRC is wrong: something in the file has changed")

    # Records

    def _window(self, table: Words, *, sure: bool) -> Iterator[Segment]:
        """Yield the messages of records; unless `sure`, what broke the next one may have begun in the last."""
        first, last = 0, table.shape[1] - 1
        for i in np.flatnonzero(table[OPCODE] != mcap.MESSAGE_OP).tolist():
            opcode, content = int(table[OPCODE, i]), self._content(self._buffer, table[:, i])
            if opcode == mcap.CHUNK_OP:
                yield from self._loose_messages(table[:, first:i])
                first = i
                yield from self._chunk(content, sure=sure or i < last)
            else:
                self._record(opcode, content, self._at + int(table[AT, i]))
        rest = table[:, first:]
        yield from self._loose_messages(
            rest if sure or not (rest[OPCODE, -1:] == mcap.MESSAGE_OP).any() else rest[:, :-1]
        )

    def _loose_messages(self, table: Words) -> Iterator[Segment]:
        messages = table[OPCODE] == mcap.MESSAGE_OP
        if messages.any():
            self._loose = True
            yield self._segment(self._buffer.copy(), table[:, messages])

    def _segment(self, buffer: Bytes, table: Words) -> Segment:
        if self.origin is None:
            self.origin = int(table[LOG, 0])
        self._last = int(table[LOG, -1])
        return Segment(buffer, table, self.dictionary)

    @staticmethod
    def _content(buffer: Bytes, column: Words) -> memoryview:
        at = int(column[AT])
        return memoryview(buffer)[at : at + int(column[SIZE])]  # type: ignore[arg-type]

    def _record(self, opcode: int, content: memoryview, place: int) -> None:
        """Check a record that is no message and no chunk, and learn schemas and channels from it."""
        try:
            if opcode in (mcap.SCHEMA_OP, mcap.CHANNEL_OP):
                self.dictionary.add(opcode, bytes(content))
            elif opcode == mcap.MESSAGE_INDEX_OP:
                mcap.parse_message_index(bytes(content))
            elif opcode == mcap.ATTACHMENT_OP:
                end = mcap.attachment_end(content)
                self._check_attachment(crc32(content[:end]), int.from_bytes(content[end : end + 4], "little"))
            elif opcode == mcap.HEADER_OP and place != len(mcap.MAGIC) + mcap.RECORD_HEAD.size:
                raise MalformedError("a second header")
            elif opcode not in (mcap.HEADER_OP, mcap.METADATA_OP) and opcode < mcap.PRIVATE_OP:
                raise MalformedError(f"opcode {opcode} does not belong there")
        except MalformedError as error:
            self.lose("undecodable", f"record at byte {place}: {error}")

    def _check_attachment(self, crc: int, expected: int) -> None:
        if expected not in (0, crc):
            self.lose("crc", "an attachment's CRC is wrong")

    def _chunk(self, content: memoryview, *, sure: bool) -> Iterator[Segment]:
        """Verify, decompress and walk a chunk; a bad one is lost as a whole, and if not `sure` what no CRC confirms."""
        try:
            head = mcap.parse_chunk_head(bytes(content[: mcap.CHUNK_HEAD_MAX]), len(content))
        except MalformedError as error:
            self.lose("undecodable", f"chunk: {error}", start=self._last)
            return
        span = {"start": head.start, "end": head.end}
        try:
            buffer = self._decompress(head.compression, content[head.at : head.at + head.compressed], head.size)
        except MalformedError as error:
            self.lose("undecodable", f"chunk: {error}", **span)
            return
        if head.crc and crc32(memoryview(buffer)[: head.size]) != head.crc:  # type: ignore[arg-type]
            self.lose("crc", "chunk with a wrong CRC", **span)
            return
        end, table = self._walk(buffer, head.size, chunk=True)
        if end != head.size:
            self.lose("undecodable", f"chunk: its last {head.size - end} bytes are no records", **span)
        if end != head.size or not (sure or head.crc):
            table = table[:, :-1]  # whose end nothing confirms: what damaged the next may have begun in it
        others = np.flatnonzero(table[OPCODE] != mcap.MESSAGE_OP)
        if len(others) > MOST_ENTRIES:
            self.lose("undecodable", f"chunk: {len(others)} schemas and channels", **span)
            return
        for i in others:
            try:
                self.dictionary.add(int(table[OPCODE, i]), bytes(self._content(buffer, table[:, i])))
            except MalformedError as error:
                self.lose("undecodable", f"record in a chunk: {error}", **span)
        if len(others) < table.shape[1]:
            yield self._segment(buffer, np.delete(table, others, axis=1) if len(others) else table)

    # Damage

    def _resume(self, file: BinaryIO, head: bytes) -> None:
        """Go on at the next consistent chunk or loose message, or end the pass as truncated."""
        broken = self._at
        self._crc = None
        for place in self._candidates(file, broken + 1):
            if self._consistent(file, place):
                self.lose("undecodable", f"{place - broken} bytes from byte {broken} are no records", start=self._last)
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
        if any(loss.kind == TRUNCATED for loss in self.losses):
            return
        end = None
        if len(head) >= mcap.RECORD_HEAD.size + mcap.CHUNK_HEAD.size and head[0] == mcap.CHUNK_OP:
            end = mcap.CHUNK_HEAD.unpack_from(head, mcap.RECORD_HEAD.size)[1]
        self.lose(TRUNCATED, f"{self.size - at} bytes unread; the file was not closed", start=self._last, end=end)


def _last_of_applications(table: Words) -> int:
    """How many of the last records are applications' own."""
    others = np.flatnonzero(table[OPCODE] < mcap.PRIVATE_OP)
    return int(table.shape[1] - 1 - others[-1]) if len(others) else table.shape[1]
