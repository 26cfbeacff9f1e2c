"""The gravity fit on recordings made with other numbers than it starts from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kbs_process.errors import FitError
from kbs_process.plant.rigid import static_wrench
from kbs_process.rig.model import substitute
from kbs_process.signals.smoothing import smooth
from kbs_process.stages import motion
from kbs_process.stages.gravity import model as gravity
from kbs_process.stages.gravity.quality import feasibility
from plant.rigs import pointing_rig, smooth_motion, wheel_rig
from stages.gravity.synthetic import FINE, RATE, perturbed, record, staircase

pytestmark = pytest.mark.slow


def calibration_angles(seconds=120.0):
    azimuth = staircase(seconds, np.linspace(-2.5, 2.5, 9))
    elevation = staircase(seconds, [1.25, 1.5, 0.2, -0.4, 1.0])
    return np.stack([azimuth, elevation], axis=1)


def pre_pointing_angles(seconds=100.0):
    t = np.arange(int(seconds * FINE)) / FINE
    elevation = smooth(np.radians(np.clip(70 + 0.3 * (t - 20), 70, 87)), 1 / FINE, 0.3)
    return np.stack([np.full_like(t, 0.3), elevation], axis=1)


def sample(run, rig, calibration=False):
    return gravity.Sample(run.name, motion.estimate(run, rig), run.wrench, calibration)


@pytest.fixture(scope="module")
def fitted():
    """Six rigs drawn from their priors, recorded and fitted: (truth, runs, model) each."""
    nominal, results = pointing_rig(), []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        truth = perturbed(nominal, rng)
        runs = [
            record(truth, "calibration", calibration_angles(), rng),
            record(truth, "pre-pointing", pre_pointing_angles(), rng),
        ]
        samples = [sample(run, nominal, run.name == "calibration") for run in runs]
        settings = gravity.GravitySettings(low_pass_Hz=1.0)
        results.append((truth, runs, gravity.fit(samples, nominal, include_inertia=False, settings=settings)))
    return results


def test_centres_of_gravity_are_recovered_within_their_sigma(fitted):
    scores = []
    for truth, _, model in fitted:
        true, found = truth.quantities(), model.rig.quantities()
        for name in ("body.antenna.cog", "body.azimuth.cog", "transducer.tilt"):
            scores.append((found[name].value - true[name].value) / found[name].sigma)
    z = np.concatenate(scores)
    assert np.mean(np.abs(z) < 2.0) > 0.88
    assert np.abs(z).max() < 4.5


def test_the_antennas_cog_is_known_far_better_than_its_prior(fitted):
    for _, _, model in fitted:
        assert np.all(model.rig.quantities()["body.antenna.cog"].sigma[[0, 2]] < 0.3e-3)


def test_the_static_wrench_is_removed_to_its_stated_error(fitted):
    for truth, runs, model in fitted:
        run = runs[1]
        estimated = motion.estimate(run, pointing_rig())
        static = gravity.apply(estimated, model, model.taring[run.name])
        q = pre_pointing_angles()[:: int(FINE / RATE)]
        true = static_wrench(truth, q)
        error = static.wrench.values - true
        error = (error - error.mean(axis=0))[100:-100]
        bound = 3.0 * np.sqrt(np.mean(static.sigma**2, axis=0))
        assert np.all(np.sqrt(np.mean(error**2, axis=0)) < bound)
        assert np.sqrt(np.mean(error[:, 4] ** 2)) < 5e-3 < np.ptp(true[:, 4])
        assert np.all(static.sigma_encoder[:, 4] > 1e-4)


def test_feasibility_compares_the_error_with_what_is_sought(fitted):
    statement = {s.channel: s for s in feasibility(fitted[0][2], {"Ty": 0.06, "Tx": 1e-6})}
    assert statement["Ty"].ratio < 0.2
    assert statement["Tx"].ratio > 1.0


def test_no_motion_is_refused_by_name():
    rig = pointing_rig()
    still = np.tile([0.3, 1.2], (int(60 * FINE), 1))
    run = record(rig, "still", still, np.random.default_rng(0))
    with pytest.raises(FitError, match=r"no joint moves in still: .*body\.antenna\.cog.*zeros of the readings"):
        gravity.fit([sample(run, rig)], rig, include_inertia=False)


def test_a_motion_too_small_to_learn_from_is_refused():
    rig = pointing_rig(step=0.0)
    t = np.arange(int(60 * FINE)) / FINE
    tiny = np.stack([0.3 + 2e-5 * np.sin(0.3 * t), 1.2 + 2e-5 * np.sin(0.4 * t)], axis=1)
    run = record(rig, "tiny", tiny, np.random.default_rng(0))
    with pytest.raises(FitError, match=r"say less about the rig .* zeros of the readings hide even"):
        gravity.fit([sample(run, rig)], rig, include_inertia=False)


def test_inertia_of_an_instrumented_wheel_is_found():
    nominal = wheel_rig()
    nominal = substitute(
        nominal,
        {"body.pushrim.inertia": nominal.quantities()["body.pushrim.inertia"].value},
        {"body.pushrim.inertia": np.array([0, 0, 0.02, 0, 0, 0])},
    )
    truth = substitute(
        nominal, {"body.pushrim.mass": 0.7, "body.pushrim.inertia": np.array([0.02, 0.02, 0.055, 0.001, 0, 0])}
    )
    _, q, _, _ = smooth_motion(1, seconds=60, rate=FINE)
    run = record(truth, "turning", 3 * q, np.random.default_rng(0))
    model = gravity.fit(
        [sample(run, nominal)],
        nominal,
        include_inertia=True,
        settings=gravity.GravitySettings(low_pass_Hz=1.5, cross_coupling=False),
    )
    found = model.rig.quantities()
    assert found["body.pushrim.mass"].value == pytest.approx(0.7, abs=4 * found["body.pushrim.mass"].sigma)
    inertia = found["body.pushrim.inertia"]
    assert inertia.value[2] == pytest.approx(0.055, abs=4 * inertia.sigma[2])
    assert inertia.sigma[2] < 2e-3


def test_what_the_calibration_left_of_the_cross_coupling_is_found():
    nominal = pointing_rig()
    X = np.zeros((6, 6))
    X[0, 4] = 0.03
    spread = np.zeros((6, 6))
    spread[0, 4] = 0.05
    loose = substitute(nominal, {"transducer.cross_coupling": np.zeros((6, 6))}, {"transducer.cross_coupling": spread})
    run = record(nominal, "calibration", calibration_angles(), np.random.default_rng(0))
    mixed = replace(run, wrench=run.wrench.derive(run.wrench.values @ (np.eye(6) + X).T, "mixed"))
    model = gravity.fit([sample(mixed, loose, True)], loose, include_inertia=False)
    found = model.rig.transducer.cross_coupling
    assert found.value[0, 4] == pytest.approx(0.03, abs=4 * found.sigma[0, 4])
    assert found.sigma[0, 4] < 0.01
