"""Offset and skew of a clock come out within the uncertainty that is stated with them."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from kbs_process.signals.records import Block, Clock
from kbs_process.stages.align.clocks import ClockData, LatencyFloor, align
from stages.recordings import stream


def read(block: Block, piece: int = 8192) -> ClockData:
    floor = LatencyFloor(int(block.stamp[0]), int(block.log[0]))
    for start in range(0, len(block), piece):
        floor.push(block.stamp[start : start + piece], block.log[start : start + piece])
    span = float(block.stamp[-1] - block.stamp[0]) * 1e-9
    return ClockData(int(block.stamp[0]), int(block.log[0]), span, floor.line(), by_recorder=False)


def nothing(t: np.ndarray) -> np.ndarray:
    return np.zeros((len(t), 1))


def pair(offset: float, skew: float, start: float, latency: float, seed: int, rate: float = 100.0) -> Clock:
    reference = read(stream(nothing, 1000.0, 200.0, skew=-12e-6, seed=seed))
    other = read(stream(nothing, rate, 200.0, start=start, offset=offset, skew=skew, latency=latency, seed=seed + 1))
    return align({"wrench": reference, "angle": other}, "wrench")["angle"]


@settings(max_examples=25, deadline=None)
@given(
    offset=st.floats(-2.0, 2.0),
    skew=st.floats(-2e-4, 2e-4),
    start=st.floats(-3.0, 3.0),
    latency=st.floats(1e-4, 2e-2),
    seed=st.integers(0, 1000),
)
def test_offset_and_skew_within_four_standard_uncertainties(
    offset: float, skew: float, start: float, latency: float, seed: int
) -> None:
    clock = pair(offset, skew, start, latency, seed)
    # True time `start` and 200 s later, as the reference's clock (skew -12 ppm, zero at true time 0) reads it:
    for own in (0.0, 200.0 / (1.0 + skew)):
        truth = (start + own * (1.0 + skew)) / (1.0 - 12e-6)
        found = clock.offset_s + (1.0 + clock.skew) * own
        sigma = np.hypot(clock.sigma_offset_s, 100.0 * clock.sigma_skew)
        assert abs(found - truth) < 4.0 * sigma
    assert clock.sigma_offset_s < 0.2 * latency + 1e-3


def test_the_stated_uncertainty_is_not_padded_out_of_use() -> None:
    errors, sigmas = [], []
    for seed in range(20):
        clock = pair(0.3, 50e-6, 0.0, 1e-3, 10 * seed)
        errors.append(clock.skew - ((1.0 + 50e-6) / (1.0 - 12e-6) - 1.0))
        sigmas.append(clock.sigma_skew)
        assert clock.sigma_offset_s < 0.3e-3  # a third of the latency's mean
    assert 0.3 < np.std(errors) / np.mean(sigmas) < 2.0


def test_streams_of_one_clock_stay_together() -> None:
    encoder = read(stream(nothing, 100.0, 200.0, offset=0.4, skew=80e-6, seed=5))
    command = read(stream(nothing, 10.0, 200.0, start=0.05, offset=0.4, skew=80e-6, seed=6))
    reference = read(stream(nothing, 1000.0, 200.0, seed=7))
    clocks = align({"wrench": reference, "angle": encoder, "command": command}, "wrench")
    assert clocks["command"].source == "same as angle"
    assert clocks["command"].skew == clocks["angle"].skew
    lead = (command.first_stamp - encoder.first_stamp) * 1e-9
    assert abs(clocks["command"].offset_s - clocks["angle"].offset_s - lead * (1 + clocks["angle"].skew)) < 1e-12


def test_synchronised_sensors_are_left_as_they_are() -> None:
    reference = read(stream(nothing, 1000.0, 200.0, seed=8))
    encoder = read(stream(nothing, 100.0, 200.0, start=0.004, seed=9))
    clock = align({"wrench": reference, "angle": encoder}, "wrench")["angle"]
    assert clock.source == "same as wrench" and clock.skew == 0.0 and clock.sigma_offset_s > 0.0
    assert abs(clock.offset_s - 0.004) < 1e-8


def test_one_message_from_the_past_does_not_tilt_the_line() -> None:
    block = stream(nothing, 1000.0, 200.0, seed=10)
    block.log[77_777] -= 5_000_000_000
    disturbed, clean = read(block).line, read(stream(nothing, 1000.0, 200.0, seed=10)).line
    assert disturbed is not None and clean is not None
    assert abs(disturbed.skew - clean.skew) < 3.0 * clean.sigma_skew
    assert abs(disturbed.offset - clean.offset) < 3.0 * clean.sigma_middle


def test_a_day_costs_no_more_memory_than_a_minute() -> None:
    floor = LatencyFloor(0, 0)
    stamps = np.arange(8192, dtype=np.int64) * 10_000_000
    for block in range(1000):  # 22 h at 100 Hz
        stamp = stamps + block * 8192 * 10_000_000
        floor.push(stamp, stamp + 1_000_000 + (stamp // 50_000))
    line = floor.line()
    assert line is not None and abs(line.skew - 20e-6) < 1e-9
    assert len(floor._floor) <= 256
