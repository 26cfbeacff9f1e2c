"""The one kernel that low-passes and differentiates: gain, phase, stop band, ends."""

from __future__ import annotations

import numpy as np
import pytest

from kbs_process.signals.smoothing import kernel_length, smooth

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
