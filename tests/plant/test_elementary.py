"""The inlined sine, cosine and floor against the standard library's."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numba import njit

from kbs_process.plant import elementary
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
