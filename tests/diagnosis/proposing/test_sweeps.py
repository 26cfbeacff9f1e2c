"""Tones that run up or down are found in noise; steady ones and noise are not taken for them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from kbs_process.diagnosis.proposing.proposals import proposed
from kbs_process.diagnosis.proposing.sweeps import sweeping
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.identification.output_error import Scalar
from kbs_process.signals.records import Array

FREE = (Scalar("joint.el.drive.Ka"),)
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


@pytest.mark.parametrize(("size", "seen"), [(7e-4, True), (0.0, False)])
def test_one_that_is_a_fraction_of_the_noise_is_proposed_from_whitened_residuals(size: float, seen: bool) -> None:
    """Its distance from the noise is some twenty sigmas, and what whitened series show is in units of these."""
    made = bench.experiment(bench.rig(), ("fit", "fit"), 1, seconds=60.0)
    t = bench.DT * np.arange(len(made.trials[0].valid))
    tone: Array = np.zeros((len(t), len(made.channels)))
    tone[:, 3] = size * np.sin(np.pi * (2.0 * 0.7 + 0.02 * t) * t)
    trials = [replace(one, measured=one.measured + tone * one.valid[:, None]) for one in made.trials]
    held = bench.standing(replace(made, trials=tuple(trials)), FREE)
    found = proposed(held.known, Scene.of(held.known.experiment, held.hypothesis, held.predicted))
    assert ("floor_sweep" in found) == seen
    if seen:
        assert found["floor_sweep"][0] == pytest.approx(0.02, abs=2e-3)
        assert found["floor_frequency"][-1] == pytest.approx(0.7, abs=0.05)


def test_a_steady_tone_and_noise_do_not_run() -> None:
    assert sweeping(series(75.0, (0.7, 0.0)), DT, HIGHEST) is None
    assert sweeping(series(75.0, None), DT, HIGHEST) is None


def test_what_is_found_does_not_depend_on_the_order_of_channels_or_their_sign() -> None:
    z = series(60.0, (1.0, 0.006))
    found, other = sweeping(z, DT, HIGHEST), sweeping(-z[:, ::-1], DT, HIGHEST)
    assert found is not None and other is not None
    np.testing.assert_allclose(found, other, rtol=1e-6)
