"""Every recording's own constant: found with its stated error, whatever else loads the transducer for a while."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kbs_process.signals.smoothing import smooth
from kbs_process.stages import motion
from kbs_process.stages.gravity import error as gravity_error
from kbs_process.stages.gravity import model as gravity
from kbs_process.stages.gravity.quality import misfits
from kbs_process.stages.gravity.taring import locate
from plant.rigs import pointing_rig
from stages.gravity.synthetic import FINE, RATE, perturbed, record, staircase

pytestmark = pytest.mark.slow

BIAS = np.array([3.0, -4.0, 6.0, 0.4, -0.6, 0.5])


def tracking(seconds=100.0):
    t = np.arange(int(seconds * FINE)) / FINE
    elevation = smooth(np.radians(np.clip(70 + 0.3 * (t - 20), 70, 87)), 1 / FINE, 0.3)
    return np.stack([np.full_like(t, 0.3), elevation], axis=1)


def calibration(seconds=120.0):
    azimuth = staircase(seconds, np.linspace(-2.5, 2.5, 9))
    elevation = staircase(seconds, [1.25, 1.5, 0.2, -0.4, 1.0])
    return np.stack([azimuth, elevation], axis=1)


def sample(run):
    return gravity.Sample(run.name, motion.estimate(run, pointing_rig()), run.wrench, run.name == "calibration")


@pytest.fixture(scope="module")
def fitted():
    """Rigs drawn from their priors, each fitted to a calibration and a run: (truth, model, generator)."""
    found = []
    for seed in range(5):
        rng = np.random.default_rng(seed)
        truth = perturbed(pointing_rig(), rng)
        runs = [record(truth, "calibration", calibration(), rng), record(truth, "run", tracking(), rng)]
        model = gravity.fit([sample(run) for run in runs], pointing_rig(), include_inertia=False)
        found.append((truth, model, rng))
    return found


def _loaded(run, start, stop, wrench):
    """The run with a wrench (6,) or (n, 6) upon the transducer between two instants."""
    values = run.wrench.values.copy()
    rows = slice(int(start * RATE), int(stop * RATE))
    values[rows] += wrench
    return replace(run, wrench=run.wrench.derive(values, "loaded"))


def test_a_held_out_recordings_constant_is_found_within_its_stated_error(fitted):
    scores = []
    for truth, model, rng in fitted:
        held_out = sample(record(truth, "held out", tracking(), rng, bias=BIAS))
        taring = gravity.tare(held_out, model)
        assert not taring.fitted
        scores.append((taring.bias - BIAS) / gravity.taring_error(model, taring))
        assert np.all(taring.noise < [0.02, 0.02, 0.02, 2e-3, 2e-3, 2e-3])
    assert np.sqrt(np.mean(np.square(scores))) < 1.5


def test_what_is_left_of_a_held_out_recording_has_no_offset_and_is_as_large_as_stated(fitted):
    for truth, model, rng in fitted:
        held_out = sample(record(truth, "held out", tracking(), rng, bias=BIAS))
        taring = gravity.tare(held_out, model)
        static = gravity.apply(held_out.motion, model, taring)
        left = held_out.wrench.values - static.wrench.values
        np.testing.assert_array_less(np.abs(left.mean(axis=0)), [0.02, 0.02, 0.02, 2e-3, 2e-3, 2e-3])
        assert all(misfit.ratio < 2.0 for misfit in misfits(held_out, model, taring))


def test_a_load_for_a_third_of_the_time_does_not_move_the_constant_as_it_moves_the_mean(fitted):
    truth, model, rng = fitted[0]
    run = record(truth, "pushed", tracking(), rng, bias=BIAS)
    pushed = sample(_loaded(run, 30.0, 63.0, np.array([5.0, 5.0, 5.0, 0.5, 0.5, 0.5])))
    moved = gravity.tare(pushed, model).bias - gravity.tare(sample(run), model).bias
    mean = pushed.wrench.values.mean(axis=0) - run.wrench.values.mean(axis=0)
    assert np.all(np.abs(moved) < 0.05 * mean)


def test_a_fitted_recording_keeps_the_constant_of_the_fit(fitted):
    _, model, rng = fitted[0]
    run = record(pointing_rig(), "run", tracking(), rng, bias=BIAS)
    taring = gravity.tare(sample(run), model)
    assert taring.fitted
    assert taring is model.taring["run"]


def test_a_spring_on_the_article_is_found_out_by_its_factor(fitted):
    truth, model, rng = fitted[0]
    q = tracking()
    run = record(truth, "sprung", q, rng, bias=BIAS)
    pull = np.zeros((len(run.wrench), 6))
    pull[:, 4] = 10.0 * (q[:: int(FINE / RATE), 1] - q[0, 1])
    sprung = sample(_loaded(run, 0.0, 1e9, pull))
    found = {misfit.channel: misfit for misfit in misfits(sprung, model, gravity.tare(sprung, model))}
    assert found["Ty"].ratio > 10.0
    assert [channel for channel, misfit in found.items() if not misfit.ok] == ["Ty"]


def test_the_budget_states_the_tarings_error_where_a_band_holds_the_constant(fitted):
    truth, model, rng = fitted[0]
    held_out = sample(record(truth, "held out", tracking(), rng, bias=BIAS))
    taring = gravity.tare(held_out, model)
    static = gravity.apply(held_out.motion, model, taring)
    slopes = gravity_error.Slopes.of(held_out.motion, model)
    _, whole, _ = gravity_error.entries(held_out.motion, static, model, slopes, lambda signal: signal)
    np.testing.assert_allclose(whole.sigma, taring.noise)
    _, varying, _ = gravity_error.entries(
        held_out.motion, static, model, slopes, lambda s: s.derive(s.values - s.values.mean(axis=0), "no constant")
    )
    np.testing.assert_allclose(varying.sigma, 0.0, atol=1e-12)


def test_location_has_the_stated_variance_for_white_and_for_coloured_noise():
    rng = np.random.default_rng(0)
    for colour in (0.0, 0.8):
        scores = []
        for _ in range(60):
            x = rng.standard_normal(1200)
            for index in range(1, len(x)):
                x[index] += colour * x[index - 1]
            location, variance, _ = locate(0.7 + x, float(np.std(x)))
            scores.append((location - 0.7) / np.sqrt(variance))
        assert 0.75 < np.std(scores) < 1.35


@pytest.mark.parametrize(("n", "rate", "phase"), [(30, 0.05, 3.8), (30, 1.1, 1.8), (61, 2.0, 2.0), (61, 2.55, 4.2)])
def test_a_location_that_no_sample_is_near_errs_by_the_range_of_all(n: int, rate: float, phase: float) -> None:
    swing = 1000.0 * np.sin(rate * np.arange(n) + phase)
    _, variance, weight = locate(swing, 1.0)
    assert variance == np.ptp(swing) ** 2
    assert np.isfinite(weight).all()
