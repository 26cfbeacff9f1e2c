"""Angles from encoder, command and rate: each against a known truth, and its stated sigma against the error made."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, lfilter

from kbs_process.errors import RecordingError
from kbs_process.rig.model import Amplifier, substitute
from kbs_process.signals.records import Signal
from kbs_process.signals.smoothing import smooth
from kbs_process.stages.motion import MotionSettings, estimate
from plant.rigs import pointing_rig, quantity
from stages.gravity.synthetic import FINE, RATE, record

pytestmark = pytest.mark.slow


def slow_ramp(seconds=120.0, rate=2e-4):
    """A joint that crosses a code every two seconds: the worst case of an encoder."""
    t = np.arange(int(seconds * FINE)) / FINE
    return np.stack([0.3 + 0.0 * t, 1.2 + rate * t + 5e-4 * np.sin(2 * np.pi * 0.02 * t)], axis=1)


def _errors(motion, q_fine):
    inner = slice(100, -100)
    return (motion.q - q_fine[:: int(FINE / RATE)])[inner], inner


def test_command_and_encoder_together_beat_the_encoder_where_the_command_is_true():
    rig, q = pointing_rig(), slow_ramp()
    run = record(rig, "slow", q, np.random.default_rng(0), deviation=5e-4)
    alone = estimate(run, rig, MotionSettings(source="encoder"))
    joined = estimate(run, rig)
    assert "command and encoder" in joined.history[1]
    error_alone, inner = _errors(alone, q)
    error_joined, _ = _errors(joined, q)
    assert error_joined[:, 1].std() < 0.1 * error_alone[:, 1].std()
    actual = np.sqrt(np.mean(error_alone[:, 1] ** 2))
    assert np.sqrt(np.mean(alone.sigma_q[inner, 1] ** 2)) == pytest.approx(actual, rel=0.1)
    # What the joined angles may have missed can be told no better than the encoder's own error allows.
    stated = np.sqrt(np.mean(joined.sigma_q[inner, 1] ** 2))
    assert np.sqrt(np.mean(error_joined[:, 1] ** 2)) < stated < 0.3 * actual


@pytest.mark.parametrize("rate", [0.0, 2e-5, 5e-5, 1e-4])
def test_the_error_of_joined_angles_is_stated(rate):
    """Ramps so slow that what the corner leaves of the rounding is most of the error."""
    rig, q = pointing_rig(), slow_ramp(rate=rate)
    motion = estimate(record(rig, "slow", q, np.random.default_rng(0), deviation=5e-4), rig)
    assert "command and encoder" in motion.history[1]
    error, inner = _errors(motion, q)
    actual = np.sqrt(np.mean(error[:, 1] ** 2))
    assert np.sqrt(np.mean(motion.sigma_q[inner, 1] ** 2)) == pytest.approx(actual, rel=0.25)


def test_the_encoder_is_kept_where_the_joint_leaves_its_command():
    rig, q = pointing_rig(), slow_ramp()
    t = np.arange(len(q)) / FINE
    wobble = 2e-3 * np.sin(2 * np.pi * 0.8 * t)
    run = record(rig, "wobble", q + wobble[:, None], np.random.default_rng(0), deviation=wobble[:, None])
    motion = estimate(run, rig)
    assert all("encoder alone" in step for step in motion.history[:2])
    error, _ = _errors(motion, q + wobble[:, None])
    assert np.sqrt(np.mean(error**2)) < 2e-4


def test_a_joint_at_rest_keeps_the_rounding_error_of_a_code():
    rig = pointing_rig()
    motion = estimate(record(rig, "rest", slow_ramp(), np.random.default_rng(0)), rig, MotionSettings(source="encoder"))
    step = float(rig.joints[0].encoder.step)
    assert motion.sigma_q[200, 0] == pytest.approx(step / np.sqrt(12), rel=0.2)


def test_derivatives_and_offset():
    rig = pointing_rig(step=0.0)
    t = np.arange(int(60 * FINE)) / FINE
    w = 2 * np.pi * 0.5
    q = np.stack([0.2 * np.sin(w * t), 0.1 * np.cos(w * t)], axis=1)
    run = record(rig, "sine", q, np.random.default_rng(0))
    shifted = substitute(rig, {"joint.az.encoder.offset": 0.01})
    motion = estimate(run, shifted, MotionSettings(source="encoder"))
    error, inner = _errors(motion, q)
    np.testing.assert_allclose(error[:, 0], -0.01, atol=1e-4)
    every = slice(0, None, int(FINE / RATE))
    np.testing.assert_allclose(motion.qd[inner, 0], 0.2 * w * np.cos(w * t[every])[inner], atol=2e-4)
    np.testing.assert_allclose(motion.qdd[inner, 0], -0.2 * w**2 * np.sin(w * t[every])[inner], atol=2e-3)


def test_a_measured_rate_is_integrated():
    rig = pointing_rig(step=0.0)
    q = slow_ramp(rate=0.01)
    run = record(rig, "rate", q, np.random.default_rng(0))
    rate = smooth(q, 1 / FINE, 2.0, derivative=1)[:: int(FINE / RATE)]
    angle = run.angle
    rated = replace(
        run, angle=None, rate=Signal(0.0, angle.dt, rate, angle.channels, ("rad/s",) * 2, "joint", angle.valid)
    )
    motion = estimate(rated, rig)
    truth = q[:: int(FINE / RATE)] - q[0]
    drift = motion.q - truth
    np.testing.assert_allclose(drift[100:-100], 0.0, atol=1e-4)
    np.testing.assert_allclose(motion.qd[100:-100], rate[100:-100], atol=1e-5)


def swing(seconds=200.0):
    """Both joints swing slowly, one of them with a ripple that is far below a code of 0.2 mrad."""
    t = np.arange(int(seconds * FINE)) / FINE
    q = 0.03 * np.sin(2 * np.pi * 0.03 * t)
    return np.stack([q, q + 1e-6 * np.sin(2 * np.pi * 1.0 * t)], axis=1)


def _rated(run, q, noise):
    """The run with measured rates: true ones with `noise` rad/s rms a sample."""
    rate = smooth(q, 1 / FINE, 2.0, derivative=1)[:: int(FINE / RATE)]
    rate = rate + noise * np.random.default_rng(1).standard_normal(rate.shape)
    return replace(run, rate=Signal(0.0, 1 / RATE, rate, run.angle.channels, ("rad/s",) * 2, "joint", run.angle.valid))


def _off(motion, q):
    """Rms errors (2, joints) of rates and accelerations."""
    true = (smooth(q, 1 / FINE, 2.0, derivative=order)[:: int(FINE / RATE)] for order in (1, 2))
    inner = slice(200, -200)
    return [np.sqrt(np.mean((x - y)[inner] ** 2, axis=0)) for x, y in zip((motion.qd, motion.qdd), true, strict=True)]


def test_accelerations_end_where_rounding_is_most_of_them():
    rig, q = pointing_rig(step=2e-4), swing()
    run = replace(record(rig, "slow", q, np.random.default_rng(0)), command=None)
    motion = estimate(run, rig)
    _, error = _off(motion, q)
    whole = smooth(run.angle.values, run.angle.dt, 2.0, derivative=2)
    _, before = _off(replace(motion, qdd=whole), q)
    assert np.all(error < 0.1 * before)
    fine = pointing_rig(step=1e-8)
    resolved = estimate(replace(record(fine, "fine", q, np.random.default_rng(0)), command=None), fine)
    assert np.all(_off(resolved, q)[1] < 0.01 * np.abs(resolved.qdd).max())


def test_a_measured_rate_serves_where_it_errs_less_than_the_encoder():
    rig, q = pointing_rig(step=2e-4), swing()
    run = replace(record(rig, "slow", q, np.random.default_rng(0)), command=None)
    alone = _off(estimate(run, rig), q)
    good = estimate(_rated(run, q, 1e-7), rig)
    assert any("by its measured rate" in step for step in good.history)
    assert _off(good, q)[1][1] < 0.3 * alone[1][1]
    for with_it, without in zip(_off(estimate(_rated(run, q, 1e-1), rig), q), alone, strict=True):
        assert np.all(with_it < 1.1 * without)


def test_a_run_without_angles_is_refused():
    rig = pointing_rig()
    run = record(rig, "none", slow_ramp(20.0), np.random.default_rng(0))
    with pytest.raises(RecordingError, match="neither angles nor rates"):
        estimate(replace(run, angle=None), rig)


def test_angles_are_as_late_as_the_amplifier_makes_the_wrench():
    """A sweep at 2 deg/s there and back, 10 N m of gravity: no error that follows the rate is left."""
    rig = pointing_rig()
    amplifier = Amplifier(2, quantity("corner", 20.0))
    slow = replace(rig, transducer=replace(rig.transducer, amplifier=amplifier))
    t = np.arange(int(200 * FINE)) / FINE
    q = np.stack([1.0 * np.sin(2 * np.pi * 0.005 * t), 1.3 + 0.2 * np.sin(2 * np.pi * 0.02 * t)], axis=1)
    run = record(rig, "sweep", q, np.random.default_rng(0))
    b, a = butter(2, 20.0, fs=FINE)
    late = lfilter(b, a, q - q[0], axis=0) + q[0]  # what the wrench behind the amplifier shows
    at_once, delayed = estimate(run, rig), estimate(run, slow)
    inner = slice(100, -100)
    error = (delayed.q - late[:: int(FINE / RATE)])[inner]
    uncorrected = (at_once.q - late[:: int(FINE / RATE)])[inner]
    rate = delayed.qd[inner]
    slope = [np.sum(e * rate, axis=0) / np.sum(rate**2, axis=0) for e in (error, uncorrected)]
    np.testing.assert_allclose(amplifier.delay, np.sqrt(2) / (2 * np.pi * 20.0), rtol=1e-12)
    np.testing.assert_allclose(slope[1], amplifier.delay, rtol=0.05)
    assert np.all(np.abs(slope[0]) < 0.05 * amplifier.delay)
