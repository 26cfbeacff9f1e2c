"""Pointing statistics on errors whose statistics are known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import norm

from kbs_process.errors import RecordingError
from kbs_process.mission.geometry import boresight, separation
from kbs_process.signals.records import Array, Signal
from kbs_process.stages import pointing

DT, PERIOD, SMOOTHING = 0.05, 6000.0, 60.0


def signal(values: Array, dt: float = DT) -> Signal:
    values = values.reshape(len(values), -1)
    names = ("az", "el")[: values.shape[1]]
    return Signal(0.0, dt, values, names, ("rad",) * len(names), "joint", np.ones(len(values), dtype=np.bool_))


def coloured(n: int, memory: float, rng: np.random.Generator) -> Array:
    """First-order noise of unit variance whose correlation falls to 1/e in `memory` samples."""
    rho = np.exp(-1.0 / memory)
    noise = rng.standard_normal(n + int(20 * memory))
    return lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], noise)[-n:]


def test_statistics_of_white_noise_are_those_of_the_normal_distribution() -> None:
    e = 3e-5 + 1e-4 * np.random.default_rng(1).standard_normal(200_000)
    (found,) = pointing.statistics(signal(e), PERIOD, SMOOTHING)
    assert found.bias == pytest.approx(3e-5, abs=1e-6)
    assert found.random == pytest.approx(2e-4, rel=0.01)
    share = norm.cdf(found.percentile, 3e-5, 1e-4) - norm.cdf(-found.percentile, 3e-5, 1e-4)
    assert share == pytest.approx(0.95, abs=2e-3)
    n = len(e)
    assert found.bias_sigma == pytest.approx(1e-4 / np.sqrt(n), rel=0.2)
    assert found.random_sigma == pytest.approx(2e-4 / np.sqrt(2.0 * n), rel=0.2)
    density = norm.pdf(found.percentile, 3e-5, 1e-4) + norm.pdf(-found.percentile, 3e-5, 1e-4)
    assert found.percentile_sigma == pytest.approx(np.sqrt(0.95 * 0.05 / n) / density, rel=0.2)


@pytest.mark.parametrize("memory", [2.0, 60.0, 400.0])
def test_intervals_cover_the_truth_of_correlated_errors(memory: float) -> None:
    """Two sigma hold 95 % of the time; fewer where few memories fit into the record (here 75 at least)."""
    rng = np.random.default_rng(7)
    truth = {"bias": 0.0, "random": 2.0, "percentile": float(norm.ppf(0.975))}
    hits = dict.fromkeys(truth, 0)
    trials = 150
    for _ in range(trials):
        (found,) = pointing.statistics(signal(coloured(30_000, memory, rng)), PERIOD, SMOOTHING)
        for name, value in truth.items():
            inside = abs(getattr(found, name) - value) <= 2.0 * getattr(found, f"{name}_sigma")
            hits[name] += inside
    rates = {name: count / trials for name, count in hits.items()}
    print(f"memory {memory:g} samples: {rates}")
    assert all(rate > 0.87 for rate in rates.values()), rates
    assert rates["bias"] < 1.0


def test_orbit_variation_is_a_slow_swing_s_amplitude() -> None:
    t = DT * np.arange(int(14600.0 / DT))
    swing = 2e-4 * np.sin(2.0 * np.pi * t / PERIOD)
    noise = 1e-4 * np.random.default_rng(3).standard_normal(len(t))
    (found,) = pointing.statistics(signal(swing + noise), PERIOD, SMOOTHING)
    assert found.orbit == pytest.approx(2e-4, rel=0.05)


def test_a_drift_over_many_orbits_counts_for_one_orbit_only() -> None:
    t = DT * np.arange(int(30000.0 / DT))
    (found,) = pointing.statistics(signal(1e-8 * t), PERIOD, SMOOTHING)
    assert found.orbit == pytest.approx(0.5 * 1e-8 * PERIOD, rel=0.02)


def test_the_error_is_taken_at_the_same_instant_as_the_command() -> None:
    t = np.arange(0.0, 100.0, 0.1)
    desired = np.stack([0.01 * t, -0.02 * t], axis=1)
    times = DT * np.arange(1980)
    actual = signal(np.stack([0.01 * times + 1e-4, -0.02 * times], axis=1))
    error = pointing.error(actual, t, desired)
    assert error.values[:, 0] == pytest.approx(1e-4, abs=1e-12)
    assert error.values[:, 1] == pytest.approx(0.0, abs=1e-12)
    late = pointing.error(actual, t + 50.0, desired)
    assert not late.valid[:999].any() and late.valid[1001:].all()


def test_line_of_sight_error_is_the_angle_between_boresights() -> None:
    rng = np.random.default_rng(5)
    desired = np.stack([rng.uniform(-2.8, 2.8, 500), rng.uniform(-0.5, 1.5, 500)], axis=1)
    error = 2e-4 * rng.standard_normal((500, 2))
    found = pointing.line_of_sight(signal(error), desired[:, 1] + error[:, 1])
    exact = separation(boresight(desired), boresight(desired + error))
    assert found.column("line of sight") == pytest.approx(exact, rel=2e-3)


def test_statistics_are_taken_within_a_stretch_and_refused_for_next_to_nothing() -> None:
    e = np.where(np.arange(4000) < 2000, 1.0, 5.0) * 1e-4
    error = signal(e)
    (late,) = pointing.statistics(error, PERIOD, SMOOTHING, error.t >= 100.0)
    assert (late.bias, late.samples) == (pytest.approx(5e-4), 2000)
    assert late.bias_sigma == pytest.approx(0.0, abs=1e-12)
    with pytest.raises(RecordingError, match="no statistics"):
        pointing.statistics(error, PERIOD, SMOOTHING, error.t < 1.0)
