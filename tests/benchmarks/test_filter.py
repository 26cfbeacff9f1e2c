"""Speed and memory of the route to a filtered band, beside a plain copy and the full-rate filter.

One hour of six channels at 1 kHz (173 MB) to 0.01 .. 1 Hz at 20 Hz. Run with
`pytest tests/benchmarks/test_filter.py --benchmark-only -s`.
"""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture
from scipy.signal import butter, sosfiltfilt

from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS, Block, Signal
from kbs_process.stages.align.condense import CondenseSettings, condense
from kbs_process.stages.align.resample import resample
from kbs_process.stages.bandpass import Band, apply

pytestmark = pytest.mark.slow

RATE, WORKING, SECONDS = 1000.0, 20.0, 3600
BAND = Band("lt1Hz", 0.01, 1.0)
TIMES_A_COPY, TIMES_FASTER, MEMORY_SHARE = 5.0, 7.0, 0.5


@pytest.fixture(scope="module")
def wrench() -> np.ndarray:
    return np.random.default_rng(1).normal(size=(int(RATE * SECONDS), 6))


def route(x: np.ndarray) -> Signal:
    values = resample(x, RATE, WORKING)
    valid = np.ones(len(values), dtype=bool)
    return apply(Signal(0.0, 1.0 / WORKING, values, WRENCH_CHANNELS, WRENCH_UNITS, "T", valid), BAND)


def full_rate(x: np.ndarray) -> np.ndarray:
    high = butter(2, 0.01, "high", output="sos", fs=RATE)
    low = butter(4, 1.0, output="sos", fs=RATE)
    return sosfiltfilt(low, sosfiltfilt(high, x, axis=0), axis=0)


def best(function: Callable[[], object], rounds: int) -> float:
    taken = []
    for _ in range(rounds):
        start = time.process_time()  # one thread each; other work on the machine does not count
        function()
        taken.append(time.process_time() - start)
    return min(taken)


def peak(function: Callable[[], object]) -> int:
    tracemalloc.start()
    function()
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return most


def test_route_to_the_band(wrench: np.ndarray, benchmark: BenchmarkFixture) -> None:
    route(wrench[:100_000])  # compile, or load what was compiled
    benchmark.pedantic(lambda: route(wrench), rounds=7, warmup_rounds=1)
    ours = best(lambda: route(wrench), 15)
    copy = best(wrench.copy, 15)
    full = best(lambda: full_rate(wrench), 1)
    memory = peak(lambda: route(wrench)) / wrench.nbytes
    print(
        f"\ncopy {1e3 * copy:.1f} ms, route {1e3 * ours:.1f} ms = {ours / copy:.2f} copies"
        f" (at most {TIMES_A_COPY:g}); full-rate sosfiltfilt {full:.2f} s = {full / ours:.1f} times the route"
        f" (at least {TIMES_FASTER:g}); extra memory {memory:.3f} of the input (at most {MEMORY_SHARE:g})"
    )
    assert full / ours >= TIMES_FASTER
    assert memory <= MEMORY_SHARE
    assert ours / copy <= TIMES_A_COPY


def recording(wrench: np.ndarray, piece: int = 20_000) -> Iterator[tuple[str, Block]]:
    for start in range(0, len(wrench), piece):
        stamp = np.arange(start, min(start + piece, len(wrench)), dtype=np.int64) * 1_000_000
        yield "wrench", Block(stamp, stamp + 300_000, wrench[start : start + piece])


def test_condense(wrench: np.ndarray, benchmark: BenchmarkFixture) -> None:
    """Everything at once: order, clock, grid, decimation, Welch's matrix, envelope."""

    def whole() -> None:
        condense("hour", recording(wrench), {"wrench": WRENCH_CHANNELS}, CondenseSettings())

    whole()
    benchmark.pedantic(whole, rounds=3)
    taken = best(whole, 3)
    memory = peak(whole) / wrench.nbytes
    print(
        f"\ncondense {taken:.2f} s for one hour at 1 kHz x 6 ({SECONDS / taken:.0f} times real time),"
        f" extra memory {memory:.3f} of the input"
    )
    assert memory <= MEMORY_SHARE
    assert SECONDS / taken > 1000.0
