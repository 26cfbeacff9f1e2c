"""Channels that show something in part of a trial count for what they show."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis import bench
from kbs_process.diagnosis.experiments.metric import counted
from kbs_process.diagnosis.experiments.whiten import independent, whitener


def test_numbers_that_windows_correlate_count_once() -> None:
    """An encoder that moves in a fifth of the time says a fifth of what one says that always moves."""
    n, rng = 1000, np.random.default_rng(1)
    windows = np.ones((n, 2))
    windows[200:, 1] = 0.0
    whiten = whitener(windows, bench.DT, (0.0, 8.0), np.tile(np.eye(2, dtype=complex), (400, 1, 1)))
    share = independent(windows)
    assert share == pytest.approx([1.0, 0.2])
    lengths = []
    for _ in range(60):
        x = rng.standard_normal((n, 2)) / np.sqrt(2.0 * bench.DT)
        lengths.append(np.sum(counted(whiten, share, x).reshape(-1, 2) ** 2, axis=0))
    mean, variance = np.mean(lengths, axis=0), np.var(lengths, axis=0)
    assert mean == pytest.approx([800.0, 160.0], rel=0.05)
    assert variance == pytest.approx(2.0 * mean, rel=0.6)  # of chi-square with as many degrees of freedom
