"""Tones that run up or down are found in noise; steady ones and noise are not taken for them."""

from __future__ import annotations

import numpy as np
import pytest

from kbs_process.diagnosis.sweeps import sweeping
from kbs_process.signals.records import Array

DT, HIGHEST = 0.1, 4.0


def series(seconds: float, tone: tuple[float, float] | None, size: float = 1.0) -> Array:
    """White noise of unit variance in eight channels, with one tone in two of them."""
    t = np.arange(0.0, seconds, DT)
    z = np.random.default_rng(5).standard_normal((len(t), 8))
    if tone is not None:
        phase = np.pi * (2.0 * tone[0] + tone[1] * t) * t
        z[:, 1] += 0.5 * size * np.sin(phase)
        z[:, 2] += size * np.cos(phase + 1.0)
    return np.asarray(z)


@pytest.mark.parametrize("sweep", [0.004, -0.009])
def test_a_tone_that_runs_is_found(sweep: float) -> None:
    seconds, start = 75.0, 0.489 if sweep > 0.0 else 2.1
    found = sweeping(series(seconds, (start, sweep)), DT, HIGHEST)
    assert found is not None
    power, frequency, rate = found
    # A few Cramer-Rao bounds: sqrt(6 / (snr n)) / (pi T) for the frequency, likewise for the sweep (Djuric and Kay).
    snr = 0.5 * (1.0 + 0.25) / 1.0
    bound = np.sqrt(96.0 / (snr * seconds / DT)) / (np.pi * seconds)
    assert frequency == pytest.approx(start, abs=4.0 * bound)
    assert rate == pytest.approx(sweep, abs=4.0 * bound * 2.0 / seconds)
    assert power == pytest.approx(0.25 * 1.25 * seconds / DT, rel=0.2)


def test_a_steady_tone_and_noise_do_not_run() -> None:
    assert sweeping(series(75.0, (0.7, 0.0)), DT, HIGHEST) is None
    assert sweeping(series(75.0, None), DT, HIGHEST) is None


def test_what_is_found_does_not_depend_on_the_order_of_channels_or_their_sign() -> None:
    z = series(60.0, (1.0, 0.006))
    found, other = sweeping(z, DT, HIGHEST), sweeping(-z[:, ::-1], DT, HIGHEST)
    assert found is not None and other is not None
    np.testing.assert_allclose(found, other, rtol=1e-6)
