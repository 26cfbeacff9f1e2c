"""The records of an MCAP file that the reader needs: schemas, channels, chunks, statistics."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import BinaryIO

from kbs_process.recordings.mcap.checksum import crc32

MAGIC = b"\x89MCAP0\r\n"
RECORD_HEAD = struct.Struct("<BQ")  # opcode, length of the content
CHUNK_HEAD = struct.Struct("<QQQII")  # start, end, uncompressed size, CRC, length of the compression's name
CHUNK_HEAD_MAX = CHUNK_HEAD.size + 16 + 8  # no compression has a longer name
FOOTER = struct.Struct("<QQI")  # summary start, summary offset start, CRC
FOOTER_SIZE = RECORD_HEAD.size + FOOTER.size + len(MAGIC)

HEADER_OP, FOOTER_OP, SCHEMA_OP, CHANNEL_OP, MESSAGE_OP, CHUNK_OP, MESSAGE_INDEX_OP = range(1, 8)
CHUNK_INDEX_OP, ATTACHMENT_OP, ATTACHMENT_INDEX_OP, STATISTICS_OP, METADATA_OP = range(8, 13)
METADATA_INDEX_OP, SUMMARY_OFFSET_OP, DATA_END_OP = range(13, 16)
PRIVATE_OP = 0x80  # from here on opcodes belong to applications

LARGEST_SUMMARY = 1 << 28  # bytes


class MalformedError(ValueError):
    """A record or message whose bytes contradict its own structure."""


@dataclass(frozen=True, slots=True)
class Schema:
    """How the messages of a channel are laid out."""

    name: str
    encoding: str
    data: bytes


@dataclass(frozen=True, slots=True)
class Channel:
    """A topic as one publisher writes it."""

    topic: str
    encoding: str
    schema: int
    metadata: bytes  # as they stand


@dataclass(slots=True)
class Dictionary:
    """The schemas and channels met so far, and those that contradict an earlier one of the same number."""

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    conflicts: int = 0

    def add(self, opcode: int, content: bytes) -> None:
        """Add a schema or channel record; the first of a number holds."""
        if opcode == SCHEMA_OP:
            number, schema = parse_schema(content)
            self.conflicts += self.schemas.setdefault(number, schema) != schema
        elif opcode == CHANNEL_OP:
            number, channel = parse_channel(content)
            self.conflicts += self.channels.setdefault(number, channel) != channel

    def schema_of(self, channel: Channel) -> Schema:
        """Return the channel's schema; one without a name where the file gives none."""
        return self.schemas.get(channel.schema, Schema("", "", b""))


@dataclass(frozen=True, slots=True)
class ChunkHead:
    """What a chunk says about itself; `at` is where the compressed records start within the content."""

    start: int  # log time, ns
    end: int
    size: int  # uncompressed
    crc: int
    compression: str
    at: int
    compressed: int


@dataclass(frozen=True, slots=True)
class Summary:
    """The summary section of a closed file, its CRC checked."""

    dictionary: Dictionary
    counts: dict[int, int] | None  # messages of each channel, by the recorder's own count
    start: int | None  # log time of the first message, ns


class Fields:
    """Reads the fields of one record in order; running out of bytes is `MalformedError`."""

    def __init__(self, content: bytes) -> None:
        self.content = content
        self.at = 0

    def bytes(self, size: int) -> bytes:
        if size > len(self.content) - self.at:
            raise MalformedError(f"{size} bytes wanted, {len(self.content) - self.at} left")
        self.at += size
        return self.content[self.at - size : self.at]

    def integer(self, size: int) -> int:
        return int.from_bytes(self.bytes(size), "little")

    def text(self) -> str:
        try:
            return self.bytes(self.integer(4)).decode()
        except UnicodeDecodeError as error:
            raise MalformedError("text that is not UTF-8") from error


def parse_schema(content: bytes) -> tuple[int, Schema]:
    """Return the number and content of a schema record."""
    fields = Fields(content)
    number = fields.integer(2)
    return number, Schema(fields.text(), fields.text(), fields.bytes(fields.integer(4)))


def parse_channel(content: bytes) -> tuple[int, Channel]:
    """Return the number and content of a channel record."""
    fields = Fields(content)
    number, schema = fields.integer(2), fields.integer(2)
    return number, Channel(fields.text(), fields.text(), schema, fields.content[fields.at :])


def parse_chunk_head(content: bytes, length: int) -> ChunkHead:
    """Parse the start of a chunk record of `length` bytes; the lengths that it states must agree."""
    fields = Fields(content)
    start, end, size, crc, name = CHUNK_HEAD.unpack(fields.bytes(CHUNK_HEAD.size))
    if name > 16:
        raise MalformedError("no compression has so long a name")
    compression = fields.bytes(name).decode("ascii", errors="replace")
    compressed = fields.integer(8)
    if fields.at + compressed > length:  # what follows the known fields belongs to later versions of the format
        raise MalformedError(f"a chunk of {length} bytes that states {compressed} bytes of records")
    return ChunkHead(start, end, size, crc, compression, fields.at, compressed)


def parse_message_index(content: bytes) -> int:
    """Return the channel that a message index is about."""
    fields = Fields(content)
    channel = fields.integer(2)
    size = fields.integer(4)
    if size % 16 or size + 6 > len(content):
        raise MalformedError("a message index of an impossible size")
    return channel


def attachment_end(content: memoryview, length: int | None = None) -> int:
    """Return where the CRC of an attachment of `length` bytes stands, of which `content` is the beginning."""
    fields = Fields(bytes(content[: 1 << 16]))
    fields.bytes(8 + 8)
    for _ in range(2):  # its name and media type
        fields.bytes(fields.integer(4))
    end = fields.integer(8) + fields.at
    if end + 4 > (len(content) if length is None else length):
        raise MalformedError("an attachment that ends behind its record")
    return end


def parse_statistics(content: bytes) -> tuple[int, dict[int, int]]:
    """Return the log time of the first message and the number of messages of each channel."""
    fields = Fields(content)
    fields.bytes(8 + 2 + 4 + 4 + 4 + 4)
    start = fields.integer(8)
    fields.bytes(8)
    size = fields.integer(4)
    if size % 10:
        raise MalformedError("statistics of an impossible size")
    return start, {fields.integer(2): fields.integer(8) for _ in range(size // 10)}


def records(content: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield (opcode, content) of every record in `content`."""
    fields = Fields(content)
    while fields.at < len(content):
        opcode = fields.integer(1)
        yield opcode, fields.bytes(fields.integer(8))


def read_summary(file: BinaryIO, size: int) -> Summary | None:
    """Read the summary section; None where the file has none, and `MalformedError` where it is damaged."""
    if size < len(MAGIC) + FOOTER_SIZE:
        return None
    file.seek(size - FOOTER_SIZE)
    tail = file.read(FOOTER_SIZE)
    opcode, length = RECORD_HEAD.unpack_from(tail)
    if not tail.endswith(MAGIC) or opcode != FOOTER_OP or length != FOOTER.size:
        return None
    section, _, crc = FOOTER.unpack_from(tail, RECORD_HEAD.size)
    end = size - FOOTER_SIZE
    if section == 0:
        return None
    if not len(MAGIC) <= section <= end or end - section > LARGEST_SUMMARY:
        raise MalformedError("the footer points outside the file")
    file.seek(section)
    content = file.read(end - section)
    if crc and crc32(tail[: -len(MAGIC) - 4], crc32(content)) != crc:
        raise MalformedError("the summary's CRC is wrong")
    dictionary, start, counts = Dictionary(), None, None
    for opcode, record in records(content):
        if opcode == STATISTICS_OP:
            start, counts = parse_statistics(record)
        else:
            dictionary.add(opcode, record)
    return Summary(dictionary, counts, start if counts else None)
