"""All six channels at once: accelerations are found, noise of the forces is not moved, a cord is noticed."""

from __future__ import annotations

import numpy as np
import pytest

from kbs_process.plant.rigid import inverse_dynamics
from kbs_process.rig.model import Spacecraft
from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS, Array, Signal
from kbs_process.stages.six_channels import Together, together
from kbs_process.stages.to_cog import to_spacecraft
from plant.rigs import pointing_rig, quantity

RIG = pointing_rig()
S = Spacecraft(quantity("spacecraft.position", [-1.1, 0.35, -1.8]), quantity("spacecraft.attitude", [0.0, 0.0, 0.02]))
SIGMA = np.repeat([3e-3, 3e-4], 3)  # N and N m, of EL089's channels below 1 Hz
N = 4000
T = 0.05 * np.arange(N)
Q = np.stack([0.3 + 0.01 * T, 1.2 + 0.001 * T], axis=1)
TORQUES = slice(3, 6)


def signal(values: Array) -> Signal:
    return Signal(0.0, 0.05, values, WRENCH_CHANNELS, WRENCH_UNITS, "T", np.ones(N, dtype=bool))


def moved() -> Array:
    """The wrench of joints that accelerate by 2 and 1 mrad/s^2."""
    rest = np.zeros_like(Q)
    qdd = np.stack([2e-3 * np.sin(3.0 * T), 1e-3 * np.cos(2.0 * T)], axis=1)
    return inverse_dynamics(RIG, Q, rest, qdd, sag=False) - inverse_dynamics(RIG, Q, rest, rest, sag=False)


def estimate(more: Array | float = 0.0) -> tuple[Together, Array]:
    """The estimate from noisy channels, and its error in S."""
    noise = SIGMA * np.random.default_rng(3).standard_normal((N, 6))
    found = together(signal(moved() + noise + more), Q, SIGMA, RIG, S)
    return found, found.wrench.values - to_spacecraft(signal(moved()), S).values


def test_a_wrench_without_noise_is_moved_as_it_is() -> None:
    found = together(signal(moved()), Q, SIGMA, RIG, S)
    np.testing.assert_allclose(found.wrench.values, to_spacecraft(signal(moved()), S).values, atol=2e-6)
    assert found.chi_square < 1e-3


def test_intervals_hold_the_truth_and_are_narrow() -> None:
    found, error = estimate()
    inside = np.mean(np.abs(error) < 1.96 * found.sigma, axis=0)
    assert np.all((inside[TORQUES] > 0.93) & (inside[TORQUES] < 0.97))
    alone = to_spacecraft(signal(SIGMA * np.random.default_rng(3).standard_normal((N, 6))), S).values
    assert np.all(found.sigma[TORQUES] < 0.3 * np.std(alone, axis=0)[TORQUES])
    assert found.explained
    assert found.chi_square == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("force", [(0.02, 0.0, 0.0), (0.0, 0.02, 0.0), (0.0, 0.0, 0.02)])
def test_a_force_that_no_motion_makes_is_noticed(force: tuple[float, float, float]) -> None:
    """A cord of some hundredths of a newton, at the elevation axis."""
    pull = np.concatenate([force, np.cross([0.0, 0.0, 0.22], force)])
    found, _ = estimate(np.sin(T)[:, None] * pull)
    assert found.chi_square > 2.0 and not found.explained
