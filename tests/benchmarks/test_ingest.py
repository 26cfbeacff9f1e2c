"""Speed and memory of the reader on two million messages, beside the floor and the peer.

The floor is the time merely to read and decompress every chunk (for JSON: and to decode every payload, untyped,
with msgspec), by the same libraries, on one thread, without CRC. The reader reads, checks and decompresses on a
second thread: where a second processor is free, it gains by that, and its ratio of times says so. The ratio of
processor times of all threads, printed beside it, is what it would take on one. Run with
`pytest tests/benchmarks/test_ingest.py --benchmark-only -s`.
"""

from __future__ import annotations

import struct
import time
import tracemalloc
from collections.abc import Callable, Iterator
from pathlib import Path

import lz4.frame
import msgspec
import numpy as np
import pytest
import zstandard
from mcap.reader import make_reader
from mcap.writer import CompressionType
from mcap_ros2.decoder import DecoderFactory
from pytest_benchmark.fixture import BenchmarkFixture

from kbs_process.recordings.mcap.messages.encoding import Encoding, OutStream
from kbs_process.recordings.mcap.source import open_recording
from kbs_process.recordings.mcap.streams import Stream
from kbs_process.recordings.mcap.writer import write_mcap
from recordings.mcap.mcap_files import rewrite

pytestmark = pytest.mark.slow

MESSAGES = 1_000_000  # of each topic
PEER_MESSAGES = 20_000
FORCE = tuple(f"wrench.{part}.{axis}" for part in ("force", "torque") for axis in "xyz")
STREAMS = (
    Stream("wrench", "/wrench", FORCE),
    Stream("angle", "/joints", ("position[az]", "position[el]", "velocity[az]", "velocity[el]")),
)


def campaign(encoding: Encoding, n: int) -> list[OutStream]:
    """A wrench at 1 kHz with all bits of noise, as a calibration matrix leaves it, and two encoders."""
    rng = np.random.default_rng(89)
    stamp = 1_700_000_000_000_000_000 + 1_000_000 * np.arange(n) + rng.integers(0, 20_000, n)
    t = np.arange(n)[:, None] / 1000
    wrench = 10 * np.sin(t * [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]) + 0.02 * rng.normal(size=(n, 6))
    angle = np.round(2**20 * np.cos(t * [0.01, 0.02])) * 2.0**-20
    joints = np.hstack([angle, -np.sin(t * [0.01, 0.02]) * [0.01, 0.02]])
    log = stamp + 20_000
    return [
        OutStream("/wrench", "wrench", stamp, log, wrench, encoding=encoding, frame="transducer"),
        OutStream("/joints", "joints", stamp, log + 100_000, joints, ("az", "el"), encoding),
    ]


def read_all(path: Path) -> int:
    """Decode every number; each block is let go of, as the pipeline does."""
    source = open_recording(path)
    count = sum(len(block) for _, block in source.read(STREAMS))
    assert not source.losses or {loss.kind for loss in source.losses} == {"truncated"}
    return count


def chunks(path: Path) -> Iterator[tuple[bytes, int]]:
    """Yield the bytes of every chunk's records, decompressed."""
    decompress = zstandard.ZstdDecompressor().decompress
    with path.open("rb") as file:
        file.seek(8)
        while len(head := file.read(9)) == 9:
            opcode, length = struct.unpack("<BQ", head)
            content = file.read(length)
            if opcode != 6:
                continue
            size, name = struct.unpack_from("<16xQ4xI", content)
            data = memoryview(content)[32 + name + 8 :]
            yield ((decompress(data) if content[32 : 32 + name] == b"zstd" else lz4.frame.decompress(data)), size)


def floor(path: Path) -> None:
    """Read and decompress, nothing else."""
    for data, size in chunks(path):
        assert len(data) == size


def json_floor(path: Path) -> None:
    """Read, decompress and decode every payload without saying what is wanted of it."""
    decode = msgspec.json.Decoder().decode
    for data, _ in chunks(path):
        view, at = memoryview(data), 0
        while at < len(data):
            (length,) = struct.unpack_from("<Q", data, at + 1)
            if data[at] == 5:
                decode(view[at + 31 : at + 9 + length])
            at += 9 + length


def best(run: Callable[[], object], rounds: int = 5, clock: Callable[[], float] = time.perf_counter) -> float:
    """Return the shortest of several times, s: the one least disturbed by other work."""
    times = []
    for _ in range(rounds):
        start = clock()
        run()
        times.append(clock() - start)
    return min(times)


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("recordings")
    paths = {name: folder / f"{name}.mcap" for name in ("ros2", "json", "protobuf", "lz4", "unindexed")}
    for name in ("ros2", "json", "protobuf"):
        write_mcap(paths[name], campaign(name, MESSAGES))
    rewrite(paths["ros2"], paths["lz4"], compression=CompressionType.LZ4)
    with paths["ros2"].open("rb") as file:  # cut off its summary, as by loss of power
        data = file.read()
    (summary,) = struct.unpack_from("<Q", data, len(data) - 28)
    paths["unindexed"].write_bytes(data[: summary - 13])
    return paths


@pytest.mark.parametrize(
    ("name", "lowest", "limit"),
    [
        ("ros2", floor, 1.6),
        ("unindexed", floor, 2.3),
        ("lz4", floor, 3.0),
        ("protobuf", floor, 1.5),
        ("json", json_floor, 2.2),
    ],
)
def test_reading_costs_little_more_than_decompressing(
    benchmark: BenchmarkFixture, files: dict[str, Path], name: str, lowest: Callable[[Path], None], limit: float
) -> None:
    path = files[name]
    rounds = 2 if name == "json" else 7
    assert read_all(path) == 2 * MESSAGES
    base = best(lambda: lowest(path), rounds)
    benchmark.pedantic(read_all, (path,), rounds=rounds)
    base = min(base, best(lambda: lowest(path), rounds))  # before and after, as other work comes and goes
    ratio = benchmark.stats.stats.min / base
    work = best(lambda: read_all(path), rounds, time.process_time)
    work /= best(lambda: lowest(path), rounds, time.process_time)
    benchmark.extra_info |= {"ratio": ratio, "processor time": work}
    print(
        f"\n{name}: {ratio:.2f} times the floor of {base:.3f} s ({path.stat().st_size / 1e6:.0f} MB), limit {limit}; "
        f"{work:.2f} times its processor time"
    )
    assert ratio <= limit


def test_peer(benchmark: BenchmarkFixture, files: dict[str, Path], tmp_path: Path) -> None:
    """mcap + mcap-ros2-support on fewer messages, extrapolated by their number."""
    path = tmp_path / "slice.mcap"
    write_mcap(path, campaign("ros2", PEER_MESSAGES // 2))

    def peer() -> None:
        with path.open("rb") as file:
            for _ in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
                pass

    benchmark.pedantic(peer, rounds=2)
    seconds = benchmark.stats.stats.min * 2 * MESSAGES / PEER_MESSAGES
    base, own = best(lambda: floor(files["ros2"])), best(lambda: read_all(files["ros2"]))
    print(
        f"\npeer: {seconds / base:.0f} times the floor, extrapolated from {PEER_MESSAGES} messages; "
        f"here {own / base:.2f}"
    )
    assert own < seconds


def test_memory(benchmark: BenchmarkFixture, files: dict[str, Path]) -> None:
    """The peak beyond the decoded arrays, all of them kept, is below their own size."""
    tracemalloc.start()
    blocks = list(open_recording(files["ros2"]).read(STREAMS))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    decoded = sum(b.stamp.nbytes + b.log.nbytes + b.values.nbytes for _, b in blocks)
    benchmark.pedantic(read_all, (files["ros2"],), rounds=1)
    print(f"\nextra memory: {(peak - decoded) / 1e6:.1f} MB beside {decoded / 1e6:.0f} MB of decoded arrays")
    assert peak - decoded < decoded
