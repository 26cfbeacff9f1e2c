"""The inlined sine, cosine and floor against the standard library's."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numba import njit

from kbs_process.plant.compiled import elementary
from kbs_process.signals.records import Array


@njit
def inlined(x: Array, out: Array) -> None:
    for i in range(x.shape[0]):
        out[i, 0] = elementary.sin(x[i])
        out[i, 1] = elementary.cos(x[i])
        out[i, 2] = elementary.floor(x[i])


@pytest.mark.parametrize("size", [1e-3, 1.0, 10.0, 1e4, 1e7])
def test_agrees_with_the_standard_library(size: float) -> None:
    x = np.concatenate([[0.0, 0.5 * math.pi, math.pi], np.random.default_rng(1).uniform(-size, size, 20000)])
    out = np.empty((len(x), 3))
    inlined(x, out)
    # The last term is what the reduced argument loses to rounding.
    tolerance = 5e-16 + 2e-16 * size * 1e-7
    assert np.abs(out[:, 0] - np.sin(x)).max() < tolerance
    assert np.abs(out[:, 1] - np.cos(x)).max() < tolerance
    np.testing.assert_array_equal(out[:, 2], np.floor(x))


@njit
def exponentials(x: Array, out: Array) -> None:
    for i in range(x.shape[0]):
        out[i, 0] = elementary.exp(x[i])
        out[i, 1] = elementary.expm1(x[i])
        out[i, 2] = elementary.tanh(x[i])
        out[i, 3] = elementary.log(abs(x[i]))


@pytest.mark.parametrize("size", [1e-12, 1e-6, 1e-3, 0.3, 1.0, 10.0, 700.0])
def test_exponentials_are_right_to_their_own_size(size: float) -> None:
    x = np.random.default_rng(2).uniform(-size, size, 20000)
    out = np.empty((len(x), 4))
    exponentials(x, out)
    for column, exact in enumerate((np.exp, np.expm1, np.tanh, lambda x: np.log(np.abs(x)))):
        np.testing.assert_allclose(out[:, column], exact(x), rtol=1e-15, atol=0.0)


def test_exponentials_at_the_ends_of_their_range() -> None:
    x = np.array([0.0, -1e6, -30.0, 30.0, 1e6])
    out = np.empty((len(x), 4))
    exponentials(x[:], out)
    assert out[0, 0] == 1.0 and out[0, 1] == 0.0 and out[0, 2] == 0.0
    assert 0.0 <= out[1, 0] < 1e-300 and np.isfinite(out[:, 0]).all() and out[4, 0] > 1e307
    np.testing.assert_array_equal(out[1:, 2], [-1.0, -1.0, 1.0, 1.0])
    powers = np.ldexp(1.0, np.arange(-1000, 1000))
    shown = np.empty((len(powers), 4))
    exponentials(powers, shown)
    np.testing.assert_allclose(shown[:, 3], np.log(powers), rtol=1e-15)
