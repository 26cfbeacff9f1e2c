"""What is left is told as the data show it."""

from __future__ import annotations

import numpy as np
import pytest

from kbs_process.stages.leftover import description

T = np.arange(0.0, 120.0, 0.05)
Q = (0.6 - 0.6 * np.cos(2.0 * np.pi * T / 40.0))[:, None]
LOAD = 5.0 * np.cos(Q[:, 0] - 0.1) + 0.1 * T
SHAPES = {
    "at 0.5 Hz": 0.05 * np.sin(2.0 * np.pi * 0.5 * T),
    "a step at 40.0 s": 0.05 * (T > 40.0),
    "a drift with time": 0.001 * T,
    "a curve of arm's angle": 0.05 * Q[:, 0] ** 2,
    "s to 80.0 s": 0.05 * np.sin(3.0 * T) * ((T > 70.0) & (T < 80.0)),
    "a lag of 0.05 s behind the angles": -0.05 * np.gradient(LOAD, 0.05),
    "no one frequency": np.zeros_like(T),
}


@pytest.mark.parametrize("words", SHAPES)
def test_what_is_left_is_told(words):
    x = SHAPES[words] + np.random.default_rng(1).normal(0.0, 0.005, len(T))
    assert words in description(x, np.ones(len(T), dtype=bool), 0.05, Q, ("arm",), LOAD)


def test_no_lag_is_as_long_as_the_recording():
    load = 1e-4 * Q[:, 0]
    words = description(0.05 * np.gradient(Q[:, 0], 0.05), np.ones(len(T), dtype=bool), 0.05, Q, ("arm",), load)
    assert "lag" not in words


def test_nothing_is_said_of_next_to_nothing():
    assert "too little" in description(np.zeros(5), np.ones(5, dtype=bool), 0.05, Q[:5], ("arm",), LOAD[:5])
