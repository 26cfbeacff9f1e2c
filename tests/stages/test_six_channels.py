"""All six channels at once: accelerations are found, noise of the forces is not moved, a cord is noticed."""

from __future__ import annotations

import numpy as np
import pytest

from kbs_process.plant.rigid import inverse_dynamics
from kbs_process.rig.model import Spacecraft, substitute
from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS, Array, Signal
from kbs_process.stages.six_channels import Together, together
from kbs_process.stages.to_cog import sigma_at_spacecraft, to_spacecraft
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


def test_both_ways_agree_within_their_noise_and_a_blow_shows() -> None:
    noise = SIGMA * np.random.default_rng(3).standard_normal((N, 6))
    found, _ = estimate()
    plain = to_spacecraft(signal(moved() + noise), S)
    sigma = sigma_at_spacecraft(SIGMA, S)
    assert found.agrees(plain, sigma, 4.5).all()
    blow = np.zeros((N, 6))
    blow[2000, 4] = 0.05
    assert found.agrees(plain.derive(plain.values + blow, "a blow"), sigma, 4.5).tolist() == [True] * 4 + [False, True]


def test_an_inertia_that_is_not_known_makes_the_estimate_as_unsure() -> None:
    body = RIG.bodies[-1]
    sure = {q.name: np.zeros(q.shape) for each in RIG.bodies for q in (each.mass, each.cog, each.inertia)}
    values = {q.name: q.value for each in RIG.bodies for q in (each.mass, each.cog, each.inertia)}
    known = together(signal(moved()), Q, SIGMA, substitute(RIG, dict(values), dict(sure)), S)
    assert known.bodies.tolist() == [0.0] * 6
    heavier = body.cog.value + np.array([0.01, 0.0, 0.0])
    unsure = substitute(RIG, dict(values), sure | {body.cog.name: np.array([0.01, 0.0, 0.0])})
    wrong = together(signal(moved()), Q, SIGMA, substitute(RIG, values | {body.cog.name: heavier}), S)
    off = np.sqrt(np.mean((wrong.wrench.values - known.wrench.values) ** 2, axis=0))
    np.testing.assert_allclose(together(signal(moved()), Q, SIGMA, unsure, S).bodies, off, rtol=0.05)


@pytest.mark.parametrize("force", [(0.02, 0.0, 0.0), (0.0, 0.02, 0.0), (0.0, 0.0, 0.02)])
def test_a_force_that_no_motion_makes_is_noticed(force: tuple[float, float, float]) -> None:
    """A cord of some hundredths of a newton, at the elevation axis."""
    pull = np.concatenate([force, np.cross([0.0, 0.0, 0.22], force)])
    found, _ = estimate(np.sin(T)[:, None] * pull)
    assert found.chi_square > 2.0 and not found.explained
