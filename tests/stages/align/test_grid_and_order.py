"""Samples find their place: in order, once, and on a grid that follows any steady rate."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kbs_process.signals.records import Block
from kbs_process.stages.align.grid import Grid, Regridder, nominal_grid
from kbs_process.stages.align.ordering import BLOCK, Orderer, Reblock, concatenate, judge
from kbs_process.stages.align.stream import Timeline


def block(stamp: np.ndarray) -> Block:
    return Block(stamp.astype(np.int64), stamp.astype(np.int64) + 100, stamp.astype(float)[:, None])


def ordered(stamp: np.ndarray) -> tuple[Block, Orderer]:
    reblock, whole = Reblock(), block(stamp)
    orderer = Orderer(judge(whole))
    out = [orderer.push(piece) for piece in [*reblock.push(whole), *reblock.flush()]]
    out.append(orderer.flush())
    return concatenate([piece for piece in out if piece is not None]), orderer


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 1000), reach=st.integers(1, BLOCK // 2), n=st.integers(10, 4 * BLOCK))
def test_any_disorder_within_the_window_is_undone(seed: int, reach: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    arrival = np.argsort(np.arange(n) + rng.uniform(0.0, reach, n))
    stamp = np.insert(arrival, n // 2, arrival[n // 2]) * 1_000_000  # and one repeat
    result, orderer = ordered(stamp)
    np.testing.assert_array_equal(result.stamp, np.arange(n) * 1_000_000)
    np.testing.assert_array_equal(result.values[:, 0], result.stamp)
    assert orderer.repeats == 1 and orderer.late == 0


def test_what_comes_too_late_is_dropped_and_counted() -> None:
    stamp = np.arange(5 * BLOCK) * 1_000_000
    stamp = np.append(np.delete(stamp, 10), stamp[10])
    result, orderer = ordered(stamp)
    assert orderer.late == orderer.displaced == 1
    assert len(result) == 5 * BLOCK - 1 and np.all(np.diff(result.stamp) > 0)


@pytest.mark.parametrize("rate", [10.0, 100.003, 240.0, 1000.03, 10_000.0])
def test_the_grid_stays_on_a_steady_clock(rate: float) -> None:
    n = BLOCK
    grid = nominal_grid(np.rint(np.arange(n) / rate * 1e9).astype(np.int64))
    assert grid.rate == pytest.approx(rate, rel=1e-9)


def test_the_grid_survives_gaps_and_jitter() -> None:
    rng = np.random.default_rng(1)
    k = np.delete(np.arange(8000), [*range(100, 900), 5000, 5001, 7000])
    stamp = np.rint((k + rng.uniform(-0.2, 0.2, len(k))) * 1e6).astype(np.int64)
    assert nominal_grid(stamp).rate == pytest.approx(1000.0, rel=1e-5)


@pytest.mark.parametrize(("rate", "jitter"), [(1e4, 1.5e-5), (1e4, 2e-5), (1e3, 2e-4), (100.0, 2e-3)])
def test_jitter_of_a_fifth_of_a_period_is_averaged(rate: float, jitter: float) -> None:
    rng = np.random.default_rng(2)
    t = np.sort(np.arange(BLOCK) / rate + jitter * rng.standard_normal(BLOCK))
    assert nominal_grid(np.unique(np.rint(1e9 * t).astype(np.int64))).rate == pytest.approx(rate, rel=1e-4)


@pytest.mark.parametrize(("rate", "stated"), [(100.0, 8.5e-5), (240.0, 5e-7)])
def test_interpolation_between_samples_errs_by_what_is_stated(rate: float, stated: float) -> None:
    u = np.arange(5000) * (1.0 + 2e-4)  # slips a whole period against the grid: every phase occurs
    x = np.cos(2.0 * np.pi * 8.0 / rate * u)[:, None]
    regrid = Regridder(Grid(0, 1e9 / rate))
    pieces = [p for start in range(0, 5000, 700) for p in regrid.push(u[start : start + 700], x[start : start + 700])]
    pieces += list(regrid.flush())
    y = np.concatenate([rows for rows, _ in pieces])[5:-5, 0]
    error = np.abs(y - np.cos(2.0 * np.pi * 8.0 / rate * np.arange(5, 5 + len(y))))
    assert 0.5 * stated < error.max() < stated
    assert all(invented is None for _, invented in pieces)


def test_a_long_gap_is_filled_in_pieces_and_flagged() -> None:
    u = np.concatenate((np.arange(100.0), np.arange(200_000.0, 200_100.0)))
    regrid = Regridder(Grid(0, 1e6))
    pieces = [*regrid.push(u, u[:, None]), *regrid.flush()]
    assert max(len(rows) for rows, _ in pieces) <= 65_536
    rows = np.concatenate([rows for rows, _ in pieces])[:, 0]
    flags = np.concatenate([np.zeros(len(r), dtype=bool) if f is None else f for r, f in pieces])
    np.testing.assert_allclose(rows, np.arange(200_100.0), atol=1e-6)
    np.testing.assert_array_equal(np.flatnonzero(flags), np.arange(100, 200_000))


def jittered(lost: slice, seed: int = 4) -> np.ndarray:
    """Stamps, ns, of a sensor at 10 kHz that jitter by a fifth of its period; `lost` are missing."""
    rng = np.random.default_rng(seed)
    t = np.sort(np.arange(4 * BLOCK) * 1e-4 + 2e-5 * rng.standard_normal(4 * BLOCK))
    return np.unique(np.rint(1e9 * np.delete(t, lost)).astype(np.int64))


@pytest.mark.parametrize("lost", [slice(0, 0), slice(9000, 9040)])
def test_stamps_that_jitter_leave_no_gaps_but_where_samples_are_missing(lost: slice) -> None:
    stamp = jittered(lost)
    grid = nominal_grid(stamp[:BLOCK])
    assert np.count_nonzero(np.diff(stamp) > 1.5 * grid.period_ns) > 0.02 * len(stamp)
    line, regrid = Timeline("wrench"), Regridder(grid)
    for start in range(0, len(stamp), 3001):
        line.push(block(stamp[start : start + 3001]))
    line.flush()
    u = grid.periods(stamp)
    pieces = [*regrid.push(u, u[:, None]), *regrid.flush()]
    flags = np.concatenate([np.zeros(len(r), dtype=bool) if f is None else f for r, f in pieces])
    missing = lost.stop - lost.start
    assert sum(gap.missing for gap in line.gaps) == pytest.approx(missing, abs=2)
    # Of thousands of long steps one may look like a lost sample.
    assert len(line.gaps) <= (missing > 0) + 1
    assert np.count_nonzero(flags) == pytest.approx(missing, abs=4)  # both ends of a gap jitter
    if missing:
        assert line.gaps[0].start == pytest.approx(0.9, abs=2e-3)
