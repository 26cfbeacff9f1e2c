"""Damaged, truncated and hostile files: a loss or an error, never a silently wrong number, never a hang."""

from __future__ import annotations

import os
import struct
import time
import tracemalloc
import zlib
from collections.abc import Iterator
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
import zstandard
from mcap.writer import CompressionType, IndexType

from kbs_process.errors import RecordingError
from kbs_process.recordings.mcap.messages.encoding import OutStream
from kbs_process.recordings.mcap.source import open_recording
from kbs_process.recordings.mcap.streams import Stream
from kbs_process.recordings.mcap.writer import write_mcap
from kbs_process.reduction.inspection import inspect_recording
from kbs_process.signals.records import Block, Loss
from recordings.mcap.mcap_files import FORCE, MAGIC, read, rewrite, top_records

WRENCH = Stream("w", "/wrench", FORCE)
N = 400
CHUNK = 6


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording in chunks of some 30 messages, one message a ms."""
    folder = tmp_path_factory.mktemp("whole")
    stamp = 10**9 + 10**6 * np.arange(N)
    values = np.random.default_rng(11).normal(size=(N, 6))
    write_mcap(folder / "one.mcap", [OutStream("/wrench", "wrench", stamp, stamp, values)])
    rewrite(folder / "one.mcap", folder / "a.mcap", compression=CompressionType.ZSTD, chunk_size=3000)
    return folder / "a.mcap"


def try_reading(path: Path) -> tuple[Block | None, tuple[Loss, ...]] | None:
    """Return what can be read and the losses; None where the file is refused."""
    try:
        blocks, losses = read(path, WRENCH)
    except RecordingError:
        return None
    return blocks.get("w"), losses


def rows(block: Block | None) -> dict[int, bytes]:
    """Return the numbers of every message by their stamp."""
    if block is None:
        return {}
    return {int(s): v.tobytes() for s, v in zip(block.stamp, block.values, strict=True)}


def check_honest(path: Path, truth: dict[int, bytes]) -> int:
    """Every row that is read must be true; if any is not there, that must be said. Return how many are read."""
    result = try_reading(path)
    if result is None:
        return 0
    block, losses = result
    found = rows(block)
    assert found.items() <= truth.items()
    assert len(found) == (0 if block is None else len(block))
    assert losses or len(found) == len(truth)
    return len(found)


def flips(data: bytes) -> Iterator[tuple[int, int]]:
    """Yield (byte, bit): every byte of the frames, and a sample of every record's content."""
    rng = np.random.default_rng(13)
    places = set(range(len(MAGIC))) | set(range(len(data) - len(MAGIC), len(data)))
    for opcode, at, length in top_records(data):
        places |= set(range(at, at + 9))
        places |= set(range(at + 9, at + 9 + min(length - 9, 44 if opcode == CHUNK else 4)))
        places |= set(rng.integers(at, at + length, 4).tolist())
    for place in sorted(places):
        yield place, int(rng.integers(8))


@pytest.mark.slow
def test_a_flipped_bit_is_never_a_wrong_number(whole: Path, tmp_path: Path) -> None:
    data = whole.read_bytes()
    truth = rows(read(whole, WRENCH)[0]["w"])
    path = tmp_path / "a.mcap"
    tried = kept = 0
    for place, bit in flips(data):
        damaged = bytearray(data)
        damaged[place] ^= 1 << bit
        path.write_bytes(damaged)
        kept += check_honest(path, truth)
        tried += 1
    assert tried > 500
    assert kept > 0.9 * tried * N  # one bad block costs one block


@pytest.mark.parametrize("options", [{"use_chunking": False}, {"index_types": IndexType.NONE, "chunk_size": 3000}])
def test_a_flipped_bit_is_noticed_by_the_data_section(whole: Path, tmp_path: Path, options: dict[str, object]) -> None:
    source, path = tmp_path / "b.mcap", tmp_path / "a.mcap"
    rewrite(whole, source, compression=CompressionType.NONE, enable_data_crcs=True, **options)
    data = source.read_bytes()
    truth = rows(read(source, WRENCH)[0]["w"])
    end = max(at for opcode, at, _ in top_records(data) if opcode == 15)
    for place in np.random.default_rng(17).integers(8, end, 150).tolist():
        damaged = bytearray(data)
        damaged[place] ^= 1 << int(place % 8)
        path.write_bytes(damaged)
        result = try_reading(path)
        assert result is None or result[1] or rows(result[0]) == truth


def test_a_bad_chunk_is_located_in_time(whole: Path, tmp_path: Path) -> None:
    data = bytearray(whole.read_bytes())
    chunks = [(at, length) for opcode, at, length in top_records(bytes(data)) if opcode == CHUNK]
    at, _ = chunks[3]
    start, end = struct.unpack_from("<QQ", data, at + 9)
    (crc_at,) = (at + 9 + 24,)
    data[crc_at] ^= 1
    path = tmp_path / "a.mcap"
    path.write_bytes(data)
    blocks, losses = read(path, WRENCH)
    (crc,) = [loss for loss in losses if loss.kind == "crc"]
    (missing,) = [loss for loss in losses if loss.kind == "missing"]
    assert crc.start_s == pytest.approx((start - 10**9) / 1e9, abs=1e-12)
    assert crc.end_s == pytest.approx((end - 10**9) / 1e9, abs=1e-12)
    assert missing.count == N - len(blocks["w"]) == (end - start) // 10**6 + 1


@pytest.mark.parametrize("indexed", [True, False])
@pytest.mark.parametrize("compression", list(CompressionType))
@pytest.mark.parametrize("chunked", [True, False])
def test_what_a_truncated_file_holds_is_read(
    whole: Path, tmp_path: Path, compression: CompressionType, chunked: bool, indexed: bool
) -> None:
    options = {} if indexed else {"index_types": IndexType.NONE, "use_statistics": False}
    path = tmp_path / "b.mcap"
    rewrite(whole, path, compression=compression, chunk_size=3000, use_chunking=chunked, **options)
    data = path.read_bytes()
    truth = rows(read(path, WRENCH)[0]["w"])
    records = list(top_records(data))
    end = max(at for opcode, at, _ in records if opcode == 15)
    path = tmp_path / "a.mcap"
    before = 0
    for cut in np.linspace(9, len(data) - 1, 60).astype(int).tolist():
        path.write_bytes(data[:cut])
        found = check_honest(path, truth)
        assert found >= before  # a longer file never gives less
        before = found
        whole_chunks = sum(opcode == CHUNK and at + length <= cut for opcode, at, length in records)
        messages = sum(opcode == 5 and at + length <= cut for opcode, at, length in records)
        if not chunked:
            assert found == messages
        elif whole_chunks:
            assert found > 0
        if cut > end:
            assert found == N


@pytest.mark.parametrize("chunked", [True, False])
def test_zeros_over_the_end_of_what_no_checksum_confirms_are_no_numbers(
    whole: Path, tmp_path: Path, chunked: bool
) -> None:
    path = tmp_path / "a.mcap"
    crcs = {"enable_crcs": False, "enable_data_crcs": False}
    rewrite(whole, path, compression=CompressionType.NONE, chunk_size=3000, use_chunking=chunked, **crcs)
    data, truth = path.read_bytes(), rows(read(path, WRENCH)[0]["w"])
    ends = [at + length for opcode, at, length in top_records(data) if opcode == (CHUNK if chunked else 5)]
    for end in ends[2:8]:
        damaged = bytearray(data)
        damaged[end - 20 : end + 20] = bytes(40)
        path.write_bytes(damaged)
        assert N // 2 < check_honest(path, truth) < N


def test_truncation_says_how_much_and_since_when(whole: Path, tmp_path: Path) -> None:
    data = whole.read_bytes()
    chunks = [(at, length) for opcode, at, length in top_records(data) if opcode == CHUNK]
    at, _ = chunks[5]
    path = tmp_path / "a.mcap"
    path.write_bytes(data[: at + 100])
    blocks, losses = read(path, WRENCH)
    (loss,) = losses
    last = (blocks["w"].log[-1] - 10**9) / 1e9
    assert (loss.kind, loss.start_s) == ("truncated", last)
    assert "100 bytes unread" in loss.detail
    assert loss.end_s == (struct.unpack_from("<Q", data, at + 17)[0] - 10**9) / 1e9  # from the chunk's head


def test_a_broken_frame_costs_its_chunk_only(whole: Path, tmp_path: Path) -> None:
    """Lengths that lead astray, zeros in the place of records: reading goes on at the next chunk."""
    data = whole.read_bytes()
    chunks = [(at, length) for opcode, at, length in top_records(data) if opcode == CHUNK]
    path = tmp_path / "a.mcap"
    for replacement in (b"\xff" * 9, b"\x06" + b"\xff" * 7 + b"\x00", bytes(60), b"\x06" + struct.pack("<Q", 5)):
        at = chunks[2][0]
        path.write_bytes(data[:at] + replacement + data[at + len(replacement) :])
        block, losses = try_reading(path) or (None, ())
        assert block is not None
        assert losses
        assert len(block) >= N - 2 * 40
        assert int(block.log[-1]) == 10**9 + 10**6 * (N - 1)


def record(opcode: int, content: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(content)) + content


def chunk(compression: str, declared: int, content: bytes, crc: int = 0) -> bytes:
    name = compression.encode()
    head = struct.pack("<QQQII", 1, 2, declared, crc, len(name)) + name
    return record(CHUNK, head + struct.pack("<Q", len(content)) + content)


def hostile(*records: bytes) -> bytes:
    return MAGIC + record(1, bytes(8)) + b"".join(records)


@pytest.mark.parametrize("declared", [100, 1 << 20, 1 << 28, 1 << 62])
@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_bombs_do_not_go_off(tmp_path: Path, compression: str, declared: int) -> None:
    """A small chunk that inflates to 256 MB, with the size in its own header or without."""
    bomb = bytes(1 << 28)
    if compression == "zstd":
        compressor = zstandard.ZstdCompressor(write_content_size=declared == 100)
        content = compressor.compress(bomb)
    else:
        content = lz4.frame.compress(bomb, store_size=declared == 100)
    path = tmp_path / "a.mcap"
    path.write_bytes(hostile(chunk(compression, declared, content)))
    tracemalloc.start()
    start = time.perf_counter()
    inspection = inspect_recording(path)
    elapsed = time.perf_counter() - start
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    honest = declared == 1 << 28 and compression == "lz4"  # within the ratio that a chunk may have
    assert inspection.state == "unreadable"
    assert inspection.losses
    assert peak < 1e7 or honest
    assert elapsed < 10


def test_more_than_declared_is_refused(tmp_path: Path) -> None:
    content = bytes(100_000)
    path = tmp_path / "a.mcap"
    for declared in (99_999, 100_001, 0):
        for compression, data in (
            ("zstd", zstandard.compress(content)),
            ("lz4", lz4.frame.compress(content)),
            ("", content),
        ):
            path.write_bytes(hostile(chunk(compression, declared, data)))
            assert "undecodable" in {loss.kind for loss in inspect_recording(path).losses}


@pytest.mark.parametrize(
    "piece",
    [
        chunk("zstd", 0, b""),
        chunk("", 0, b""),
        chunk("zstd", 1 << 16, zstandard.compress(bytes(1 << 16))),
        record(5, b""),
        record(5, bytes(22)),
        record(0x80, b""),
        record(0, b""),
        record(CHUNK, b""),
        b"\x06" + struct.pack("<Q", 1 << 40) + b"\0\0\0",
        b"\x05\x00\x00\x00\x00\x00\x00\x00\x00",
        b"\x00",
        b"\x06\x10\x00\x00\x00\x00\x00\x00\x00",
    ],
)
def test_work_is_bounded_by_the_size_of_the_file(tmp_path: Path, piece: bytes) -> None:
    """48 kB of the same small record, real or not, and of overlapping ones, take a moment."""
    path = tmp_path / "a.mcap"
    path.write_bytes(hostile(piece * (48_000 // len(piece))))
    start = time.process_time()
    inspection = inspect_recording(path)
    assert time.process_time() - start < 20
    assert inspection.state == "unreadable"


def test_a_tail_of_zeros_is_one_loss(whole: Path, tmp_path: Path) -> None:
    """What a logger had set aside and not written when its power failed."""
    path = tmp_path / "a.mcap"
    data = whole.read_bytes()
    path.write_bytes(data[: len(data) // 2] + bytes(100_000))
    read = try_reading(path)
    assert read is not None
    assert len(read[1]) < 5


def test_an_index_that_overlaps_is_never_followed(whole: Path, tmp_path: Path) -> None:
    """The summary's chunk indexes may say what they like: chunks are read once, where they are."""
    data = whole.read_bytes()
    section = struct.unpack_from("<Q", data, len(data) - 28)[0]
    first = next(data[at : at + length] for opcode, at, length in top_records(data) if opcode == 8)
    summary = data[section : len(data) - 37] + first * 2000
    footer = struct.pack("<BQQQ", 2, 20, section, 0)
    crc = zlib.crc32(footer, zlib.crc32(summary))
    path = tmp_path / "a.mcap"
    path.write_bytes(data[:section] + summary + footer + struct.pack("<I", crc) + MAGIC)
    block, losses = try_reading(path) or (None, ())
    assert block is not None
    assert len(block) == N
    assert losses == ()


@pytest.mark.parametrize("content", [b"", b"\x89", b"not an MCAP file at all", b"%PDF-1.4" + bytes(99), MAGIC[:7]])
def test_files_that_are_no_recordings(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=r"a\.mcap: (the file is empty|this is not an MCAP file)"):
        open_recording(path)
    assert inspect_recording(path).state == "unreadable"
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "zero.mcap").symlink_to("/dev/zero")
    for name, what in {"none": "No such file", ".": "a folder", "pipe": "a pipe", "zero.mcap": "a device"}.items():
        with pytest.raises(RecordingError, match=f"cannot be opened: .*{what}"):
            open_recording(tmp_path / name)


def test_an_attachment_is_checked(tmp_path: Path, whole: Path) -> None:
    data = whole.read_bytes()
    end = max(at for opcode, at, _ in top_records(data) if opcode == 15)
    content = struct.pack("<QQII", 1, 1, 0, 0) + struct.pack("<Q", 5) + b"notes"
    path = tmp_path / "a.mcap"
    for crc, kinds in ((zlib.crc32(content), set()), (7, {"crc"}), (0, set())):
        path.write_bytes(data[:end] + record(9, content + struct.pack("<I", crc)) + data[end : end + 13])
        block, losses = try_reading(path) or (None, ())
        assert block is not None
        assert len(block) == N
        assert {loss.kind for loss in losses} - {"truncated"} == kinds
