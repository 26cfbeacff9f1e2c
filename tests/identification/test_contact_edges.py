"""Edges of tooth contact: found around the whole turn, from responses of narrow contacts that add."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from kbs_process.estimation.fit import Parameters, difference_jacobian
from kbs_process.identification.contact import edge_minima, left_to_contact
from kbs_process.identification.screening import Contact

pytestmark = pytest.mark.slow

FINE = 512  # places around a turn
PSI = -np.pi + (np.arange(FINE) + 0.5) * 2.0 * np.pi / FINE
PARAMETERS = Parameters(
    ("Ts0", "delta", "phi_stat", "gain"),
    np.array([6e-3, 0.5, 0.0, 0.0]),
    np.array([2e-3, 0.1, np.inf, 1.0]),
    np.array([0.0, 0.0, -np.inf, -9.0]),
    np.array([1.0, np.pi, np.inf, 9.0]),
)
CONTACT = Contact(torque=0, width=1, phase=2)
WITHIN = np.array([1e-3, 0.05, 0.05, 1.0])  # numbers have slopes
TRUE = np.array([5e-3, 0.45, 2.9, 0.4])  # the contact lies across the end of the turn


class Turning:
    """A plant in which friction at each place of a turn has a response of its own: a few harmonics."""

    def __init__(self) -> None:
        rng = np.random.default_rng(4)
        waves = [f(k * PSI) / k for k in range(1, 9) for f in (np.cos, np.sin)]
        self.response = rng.standard_normal((300, len(waves))) @ np.array(waves) * (3e4 / FINE)
        self.other = rng.standard_normal(300)
        self.measured = self.model(TRUE) + rng.standard_normal(300)

    def model(self, theta: np.ndarray) -> np.ndarray:
        inside = np.abs((PSI + theta[2] + np.pi) % (2.0 * np.pi) - np.pi) < theta[1]
        return self.response @ (theta[0] * inside) + theta[3] * self.other

    def residuals(self, thetas: Sequence[np.ndarray]) -> list[np.ndarray]:
        return [self.measured - self.model(theta) for theta in thetas]

    def slopes(self, theta: np.ndarray) -> np.ndarray:
        J = np.zeros((300, 4))
        J[:, 3] = -self.other
        return J


@pytest.mark.parametrize("phase", [-2.5, 0.0, 2.0, 9.0])
def test_true_edges_come_first_wherever_the_search_is(phase: float) -> None:
    plant = Turning()
    at = np.array([3e-3, 0.6, phase, 0.0])
    first, *_ = edge_minima(plant.residuals, at, plant.slopes(at), PARAMETERS, CONTACT, 4)
    step = 2.0 * np.pi / 128.0
    assert abs((first[2] - TRUE[2] + np.pi) % (2.0 * np.pi) - np.pi) < step
    assert abs(first[1] - TRUE[1]) < step
    assert first[0] == pytest.approx(TRUE[0], rel=0.1)
    assert abs(first[2] - phase) <= np.pi  # in the turn where it was
    assert first[3] == at[3]


def test_other_minima_follow_and_cost_more() -> None:
    plant = Turning()
    at = np.array([3e-3, 0.6, 0.0, 0.4])
    found = edge_minima(plant.residuals, at, plant.slopes(at), PARAMETERS, CONTACT, 4)
    costs = [float(np.sum((plant.measured - plant.model(theta)) ** 2)) for theta in found]
    assert len(found) > 1
    assert costs[0] == min(costs)
    assert costs[0] < 0.5 * float(np.sum((plant.measured - plant.model(at)) ** 2))


def left(at: np.ndarray) -> tuple[float, int]:
    plant = Turning()
    J = difference_jacobian(lambda theta: plant.measured - plant.model(theta), at, 1e3 * WITHIN)
    return left_to_contact(plant.residuals, at, J, PARAMETERS, CONTACT)


def test_true_contact_leaves_nothing_that_friction_elsewhere_explains() -> None:
    gained, count = left(TRUE)
    assert 0 < count <= 32
    assert gained == pytest.approx(count, abs=4.0 * np.sqrt(2.0 * count))


@pytest.mark.parametrize("edges", [(0.15, 0.0), (0.0, 0.15), (0.1, -0.1)])
def test_contact_in_a_wrong_place_is_noticed(edges: tuple[float, float]) -> None:
    gained, count = left(TRUE + np.array([0.0, *edges, 0.0]))
    assert gained > count + 6.0 * np.sqrt(2.0 * count)
