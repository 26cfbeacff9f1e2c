"""Amplifier, encoder and the shape of the streams."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import butter, freqs

from kbs_process.errors import ConfigError, SimulationError
from kbs_process.plant.amplifier import discretised, steady
from kbs_process.plant.predict import predict
from kbs_process.plant.schedule import Schedule
from kbs_process.rig.model import Amplifier, substitute
from plant.plant_rigs import CODE, NOMINAL, one_axis, quantity, streams, two_axis


def climbing(duration: float) -> Schedule:
    t = np.arange(0.0, duration + 0.05, 0.1)
    return Schedule(t, np.stack([0.1 + 0.02 * t, 1.2 + 0.01 * t], 1), np.tile([0.02, 0.01], (len(t), 1)))


@pytest.mark.parametrize("order", [1, 2, 3, 4, 8])
def test_amplifier_is_butterworth(order: int) -> None:
    step, corner = 1e-4, 20.0
    A, b = discretised(Amplifier(order, quantity("corner", corner)), step)
    for f in (1.0, 20.0, 60.0):
        z = np.exp(2j * np.pi * f * step)
        held = (1 - 1 / z) / (2j * np.pi * f * step)  # what the steps of the input do to it
        response = np.linalg.solve(z * np.eye(order) - A, b)[-1] / held
        exact = freqs(*butter(order, 2 * np.pi * corner, analog=True), worN=[2 * np.pi * f])[1][0]
        assert abs(response) == pytest.approx(abs(exact), rel=1e-3)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_amplifier_starts_settled(order: int) -> None:
    A, b = discretised(Amplifier(order, quantity("corner", 20.0)), 1e-3)
    wrench = np.arange(1.0, 7.0)
    state = steady(order, wrench)
    np.testing.assert_allclose(state @ A.T + np.outer(wrench, b), state, rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(state[:, -1], wrench)


def test_streams_have_stamps_and_shapes() -> None:
    stamps: dict[str, list[np.ndarray]] = {}
    done: list[float] = []
    for key, block in predict(
        two_axis(), NOMINAL, climbing(12.0), rate_Hz=250.0, angle_rate_Hz=40.0, duration_s=12.0, progress=done.append
    ):
        stamps.setdefault(key, []).append(block.stamp)
        assert block.values.shape == (len(block), 6 if key == "wrench" else 2)
        assert len(block) <= 2500
    for key, rate in (("wrench", 250.0), ("angle", 40.0), ("field", 10.0)):
        expected = np.rint(np.arange(round(12.0 * rate)) / rate * 1e9).astype(np.int64)
        np.testing.assert_array_equal(np.concatenate(stamps[key]), expected)
    assert done[-1] == 1.0
    assert done == sorted(done)


def test_encoder_rounds_to_codes_with_its_offset() -> None:
    of = substitute(two_axis(), {"joint.el.encoder.offset": 1e-3})
    settings = {"rate_Hz": 100.0, "angle_rate_Hz": 10.0, "duration_s": 2.0}
    codes = streams(of, NOMINAL, climbing(2.0), **settings)["angle"]
    exact = streams(of, NOMINAL, climbing(2.0), quantise=False, **settings)["angle"]
    plain = streams(two_axis(), NOMINAL, climbing(2.0), quantise=False, **settings)["angle"]
    np.testing.assert_allclose(codes / CODE, np.rint(codes / CODE), atol=1e-9)
    assert np.abs(codes - exact).max() <= 0.5 * CODE * (1 + 1e-9)
    np.testing.assert_allclose(exact[:, 1] - plain[:, 1], 1e-3, atol=1e-12)


def test_recording_that_starts_after_its_commands() -> None:
    """The same motion, the recorder switched on 1.5 s late."""
    late = climbing(6.0)
    early = Schedule(late.t - 1.5, late.position, late.rate)
    settings = {"rate_Hz": 100.0, "angle_rate_Hz": 100.0, "quantise": False}
    whole = streams(two_axis(), NOMINAL, late, duration_s=5.0, **settings)
    part = streams(two_axis(), NOMINAL, early, duration_s=3.5, **settings)
    np.testing.assert_allclose(part["wrench"], whole["wrench"][150:], atol=1e-7)
    np.testing.assert_allclose(part["angle"], whole["angle"][150:], atol=1e-9)


@pytest.mark.slow
def test_a_motor_too_weak_to_hold_is_refused() -> None:
    of = substitute(one_axis(stiffness=None), {"joint.tip.drive.parameters.Tmax": 1e-3})
    schedule = Schedule(np.array([0.0, 0.1]), np.zeros((2, 1)), np.zeros((2, 1)))
    with pytest.raises(SimulationError, match="cannot hold"):
        predict(of, NOMINAL, schedule, rate_Hz=100.0, angle_rate_Hz=10.0, duration_s=1.0)


@pytest.mark.slow
def test_an_unstable_solution_is_reported() -> None:
    of = substitute(
        one_axis(stiffness=None), {"body.load.inertia": [1e-9, 1e-9, 1e-9, 0, 0, 0], "body.load.cog": [0, 0, 0]}
    )
    schedule = Schedule(np.array([0.0, 0.1]), np.zeros((2, 1)), np.full((2, 1), 0.1))
    moving = Schedule(schedule.t, np.array([[0.0], [0.02]]), schedule.rate)
    with pytest.raises(SimulationError, match="smaller step"):
        streams(of, NOMINAL, moving, rate_Hz=100.0, angle_rate_Hz=10.0, duration_s=2.0)


def test_missing_parameter_is_named() -> None:
    of = two_axis()
    of.joints[1].drive.parameters.pop("Ts0")  # type: ignore[union-attr]
    with pytest.raises(ConfigError, match=r"joint.el.drive.parameters.*Ts0"):
        predict(of, NOMINAL, climbing(1.0), rate_Hz=100.0, angle_rate_Hz=10.0, duration_s=1.0)
