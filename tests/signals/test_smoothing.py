"""The one kernel that low-passes and differentiates: gain, phase, stop band, ends."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import fftconvolve

from kbs_process.signals.smoothing import kernel_length, smooth, smooth_rows

DT, CORNER = 0.05, 2.0
T = DT * np.arange(2000)
INNER = slice(kernel_length(CORNER, DT), -kernel_length(CORNER, DT))


@pytest.mark.parametrize("f", [0.05, 0.5, 1.0, 2.0])
def test_pass_band_is_flat_in_value_and_derivatives(f):
    w = 2 * np.pi * f
    x = np.sin(w * T + 0.3)[:, None]
    exact = (x, w * np.cos(w * T + 0.3)[:, None], -(w**2) * x)
    for order in (0, 1, 2):
        error = smooth(x, DT, CORNER, order) - exact[order]
        assert np.abs(error[INNER]).max() < 2e-4 * (2 * np.pi * CORNER) ** order


@pytest.mark.parametrize("f", [4.0, 6.0, 9.0])
def test_stop_band_starts_at_twice_the_corner(f):
    w = 2 * np.pi * f
    x = np.sin(w * T)
    for order in (0, 1, 2):
        assert np.abs(smooth(x, DT, CORNER, order)[INNER]).max() < 5e-4 * w**order


def test_straight_lines_keep_their_slope_to_the_ends():
    x = 3.0 + 2.0 * T
    np.testing.assert_allclose(smooth(x, DT, CORNER), x, atol=1e-9)
    np.testing.assert_allclose(smooth(x, DT, CORNER, 1), 2.0, atol=1e-3)
    np.testing.assert_allclose(smooth(x, DT, CORNER, 2), 0.0, atol=1e-7)


def test_records_shorter_than_the_kernel_are_taken():
    assert smooth(np.arange(9.0)[:, None], DT, 0.1).shape == (9, 1)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_across_its_pieces_the_filter_is_that_of_the_whole(order):
    """Long enough for three pieces; the whole is filtered by the kernel as an impulse shows it."""
    n, half = 150_001, kernel_length(CORNER, DT)
    x = np.cumsum(np.random.default_rng(3).standard_normal((n, 2)), axis=0)
    impulse = np.zeros(4 * half + 1)
    impulse[2 * half] = 1.0
    kernel = smooth(impulse, DT, CORNER, order)[half : 3 * half + 1]
    whole = fftconvolve(np.pad(x, ((half, half), (0, 0)), mode="reflect", reflect_type="odd"), kernel[:, None], "valid")
    atol = 1e-10 * np.abs(whole).max()
    np.testing.assert_allclose(smooth(x, DT, CORNER, order), whole, rtol=0, atol=atol)
    thinned = smooth_rows(lambda at: x[at], n, DT, CORNER, order, every=7)
    np.testing.assert_allclose(thinned, whole[::7], rtol=0, atol=atol)
