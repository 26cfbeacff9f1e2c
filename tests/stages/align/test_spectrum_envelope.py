"""Welch's matrix against scipy's, and an envelope that loses no extreme."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import csd

from kbs_process.stages.align.envelope import MinMax
from kbs_process.stages.align.spectrum import Welch


@pytest.mark.parametrize("piece", [8192, 1000, 40_000])
def test_welch_equals_scipy(piece: int) -> None:
    rng = np.random.default_rng(1)
    x = rng.normal(size=(40_000, 3)).cumsum(axis=0)
    x[:, 1] += np.roll(x[:, 0], 5)
    welch = Welch(1000.0, 0.25, 100.0, ("Fx", "Fy", "Fz"))
    for start in range(0, len(x), piece):
        welch.push(x[start : start + piece], None)
    spectrum = welch.result()
    assert spectrum is not None
    assert spectrum.f[-1] <= 100.0 and spectrum.f[1] <= 0.25
    for i in range(3):
        for j in range(3):
            f, expected = csd(x[:, i], x[:, j], fs=1000.0, window="hann", nperseg=4096)
            scale = np.sqrt(np.abs(spectrum.S[:, i, i] * spectrum.S[:, j, j]))
            assert np.abs(spectrum.S[:, i, j] - expected[f <= 100.0]).max() < 1e-10 * scale.max()
    assert spectrum.averages == (40_000 - 4096) // 2048 + 1


def test_segments_with_invented_samples_do_not_count() -> None:
    x = np.random.default_rng(2).normal(size=(20_000, 1))
    flags = np.zeros(len(x), dtype=bool)
    flags[9000:9500], x[9000:9500] = True, 1e6
    welch = Welch(1000.0, 1.0, 100.0, ("Tz",))
    welch.push(x, flags)
    spectrum = welch.result()
    assert spectrum is not None
    assert np.median(spectrum.S.real) == pytest.approx(2.0 / 1000.0, rel=0.2)


def test_a_short_recording_gets_a_coarser_spectrum() -> None:
    welch = Welch(1000.0, 0.1, 100.0, ("Tz",))
    welch.push(np.random.default_rng(3).normal(size=(9000, 1)), None)
    spectrum = welch.result()
    assert spectrum is not None and spectrum.averages >= 7


@settings(max_examples=40, deadline=None)
@given(n=st.integers(1, 3000), stretches=st.integers(2, 64), seed=st.integers(0, 99), mean=st.floats(1.0, 500.0))
def test_the_envelope_is_exact_bounded_and_independent_of_the_pieces(
    n: int, stretches: int, seed: int, mean: float
) -> None:
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(n, 2))
    pieces = MinMax(2, stretches)
    start = 0
    while start < n:
        stop = start + 1 + int(rng.exponential(mean))
        pieces.push(x[start:stop])
        start = stop
    envelope = pieces.result(0.0, 1.0)
    used = len(envelope.t)
    assert used <= stretches
    length = 1
    while -(-n // length) > stretches - stretches % 2:
        length *= 2
    for k in range(used):
        stretch = x[k * length : (k + 1) * length]
        np.testing.assert_array_equal(envelope.low[k], stretch.min(axis=0))
        np.testing.assert_array_equal(envelope.high[k], stretch.max(axis=0))
        assert envelope.t[k] == pytest.approx(k * length + 0.5 * (len(stretch) - 1))
