"""Moving a wrench keeps its meaning: known arms, and the errors that an uncertain pose makes."""

import numpy as np
import pytest

from kbs_process.errors import RecordingError
from kbs_process.rig.model import Quantity, Spacecraft
from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS, Signal
from kbs_process.stages.to_cog import sigma_at_spacecraft, sigma_of_pose, to_spacecraft


def quantity(name: str, value: list[float], unit: str, sigma: list[float]) -> Quantity:
    return Quantity(name, np.array(value), unit, np.array(sigma), "test")


def spacecraft(position, attitude, sigma_p=(0.0, 0.0, 0.0), sigma_a=(0.0, 0.0, 0.0)) -> Spacecraft:
    return Spacecraft(
        quantity("spacecraft.position", position, "m", sigma_p),
        quantity("spacecraft.attitude", attitude, "rad", sigma_a),
    )


def wrench(values: np.ndarray) -> Signal:
    return Signal(0.0, 0.05, values, WRENCH_CHANNELS, WRENCH_UNITS, "T", np.ones(len(values), dtype=bool))


def test_a_force_on_a_known_arm():
    # 2 N along +y at T's origin, which lies 1.5 m along +x from the centre of mass: torque +3 N m about z.
    moved = to_spacecraft(wrench(np.array([[0.0, 2, 0, 0, 0, 0]])), spacecraft([-1.5, 0, 0], [0, 0, 0]))
    assert moved.frame == "S"
    np.testing.assert_allclose(moved.values, [[0, 2, 0, 0, 0, 3.0]], atol=1e-12)


def test_turned_axes():
    # S is T turned by +90 deg about z: what T calls x, S calls -y.
    moved = to_spacecraft(wrench(np.array([[1.0, 0, 0, 0, 4, 0]])), spacecraft([0, 0, 0], [0, 0, np.pi / 2]))
    np.testing.assert_allclose(moved.values, [[0, -1, 0, 4, 0, 0]], atol=1e-12)


def test_errors_match_a_simulation_of_them():
    rng = np.random.default_rng(3)
    place = spacecraft([-1.1, 0.3, -1.8], [0.1, -0.2, 0.3], (0.01, 0.02, 0.005), (0.001, 0.002, 0.003))
    signal = wrench(rng.normal(size=(400, 6)) * [1, 2, 3, 0.5, 0.2, 0.1])
    reference = to_spacecraft(signal, place).values
    squares = np.zeros(6)
    draws = 600
    for _ in range(draws):
        other = spacecraft(
            place.position.value + rng.normal(size=3) * place.position.sigma,
            place.attitude.value + rng.normal(size=3) * place.attitude.sigma,
        )
        squares += np.mean((to_spacecraft(signal, other).values - reference) ** 2, axis=0) / draws
    np.testing.assert_allclose(sigma_of_pose(signal, place), np.sqrt(squares), rtol=0.12)


def test_independent_channels_add_in_quadrature():
    sigma = np.array([0.1, 0.2, 0.3, 0.01, 0.02, 0.03])
    place = spacecraft([-1.1, 0.35, -1.8], [0, 0, 0])
    _, y, z = place.position.value
    moved = sigma_at_spacecraft(sigma, place)
    np.testing.assert_allclose(moved[:3], sigma[:3])
    assert moved[3] == pytest.approx(np.sqrt(0.01**2 + (y * 0.3) ** 2 + (z * 0.2) ** 2))


def test_a_missing_force_channel_is_said():
    few = Signal(0.0, 0.05, np.zeros((4, 1)), ("Ty",), ("N m",), "T", np.ones(4, dtype=bool))
    with pytest.raises(RecordingError, match="Fx"):
        to_spacecraft(few, spacecraft([0, 0, 0], [0, 0, 0]))
