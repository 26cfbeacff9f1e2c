"""Taps: the signals that the plant's effects see are those of its motion, and looking changes nothing."""

from __future__ import annotations

import numpy as np
import pytest

from kbs_process.plant.compiled.simulation import Simulation
from kbs_process.plant.laws import select
from kbs_process.plant.predict import tap_columns
from kbs_process.plant.schedule import Schedule
from plant import energetics as lab
from plant.plant_rigs import NOMINAL, streams, three_axis

pytestmark = pytest.mark.slow

RATE = 500.0
START, SPEED = np.array([0.3, 0.5, -0.4]), np.radians([2.0, -3.0, 4.0])


def moving(duration: float) -> Schedule:
    t = np.arange(0.0, duration + 0.1, 0.1)
    return Schedule(t, START + np.outer(t, SPEED), np.tile(SPEED, (len(t), 1)))


def test_signals_are_those_of_the_motion() -> None:
    of = three_axis(amplifier=None)
    made = Simulation(of, select(NOMINAL), moving(2.0), step=1e-3, per_sample=1, angle_rate=1e3, end=1.0, taps=True)
    made.advance(700, 1)
    motion = lab.motion(of, made)
    microsteps = np.floor((START + SPEED * made.first * made.step) * 100.0 * made.microsteps + 0.5)
    _, _, state = made.advance(1, 1)
    named = dict(zip(tap_columns(of), state[0], strict=True))
    for i, joint in enumerate(of.joint_names):
        assert named[f"field.{joint}"] == microsteps[i] / made.microsteps[i]
        assert named[f"rotor_angle.{joint}"] == motion.theta[i]
        assert abs(named[f"rotor_rate.{joint}"] - motion.rotor_rates[i]) < 1e-8
        assert named[f"joint_angle.{joint}"] == motion.coordinates[3 + i]
        assert named[f"joint_rate.{joint}"] == motion.rates[3 + i]
    for i, axis in enumerate("xyz"):
        assert named[f"angle.T{axis}"] == motion.coordinates[i]
        assert abs(named[f"rate.T{axis}"] - motion.rates[i]) < 1e-8
    assert np.abs(motion.rates[:3]).max() > 1e-5  # the plate's own motion counts
    assert np.abs(motion.rotor_rates - motion.spin).max() > 1e-3  # and so does the carriers'


def test_taps_lie_at_the_samples_and_change_nothing() -> None:
    of = three_axis(amplifier=None)
    settings = {"rate_Hz": RATE, "angle_rate_Hz": RATE, "duration_s": 12.0, "quantise": False}
    plain = streams(of, NOMINAL, moving(12.0), **settings)
    tapped = streams(of, NOMINAL, moving(12.0), taps=True, **settings)
    assert set(tapped) - set(plain) == {"state"}
    for key, values in plain.items():
        np.testing.assert_array_equal(values, tapped[key])
    columns = tap_columns(of)
    assert tapped["state"].shape == (len(plain["wrench"]), len(columns))
    angle = tapped["state"][:, [columns.index(f"joint_angle.{joint}") for joint in of.joint_names]]
    np.testing.assert_allclose(angle, plain["angle"], rtol=0.0, atol=1e-12)
