"""Posterior linearisation: exact where a model is linear, and calibrated where it jumps within the posterior."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from kbs_process.estimation.fit import Parameters
from kbs_process.estimation.linearise import Unpredicted, draws, linearised

pytestmark = pytest.mark.slow

N, P = 60, 3
PARAMETERS = Parameters(("a", "b", "c"), np.zeros(P), np.full(P, 5.0))


def test_whitened_length_is_that_of_the_whole_covariance() -> None:
    rng = np.random.default_rng(1)
    E, r = rng.standard_normal((N, 4)), rng.standard_normal((N, 2))
    z = Unpredicted(E).whitened(r)
    np.testing.assert_allclose(z.T @ z, r.T @ np.linalg.solve(np.eye(N) + E @ E.T, r), rtol=1e-12)
    np.testing.assert_allclose(Unpredicted(E).whitened(r[:, 0]), z[:, 0], rtol=1e-12)


def test_linear_model_has_its_exact_posterior() -> None:
    rng = np.random.default_rng(2)
    A, y = rng.standard_normal((N, P)), rng.standard_normal(N)
    at = np.array([0.3, -0.2, 0.1])
    model = linearised(lambda many: [y - A @ one for one in many], -A, at, draws(at, np.eye(P), PARAMETERS, 8, rng))
    mean, C = model.posterior(PARAMETERS)
    exact = np.linalg.inv(A.T @ A + np.eye(P) / 25.0)
    np.testing.assert_allclose(C, exact, rtol=1e-9)
    np.testing.assert_allclose(mean, exact @ A.T @ y, rtol=1e-9)


def test_draws_come_in_pairs_and_within_bounds() -> None:
    bounded = Parameters(("a",), np.zeros(1), np.ones(1), np.array([-0.5]), np.array([0.5]))
    points = np.ravel(draws(np.zeros(1), np.eye(1), bounded, 40, np.random.default_rng(3)))
    assert len(points) == 40
    assert np.max(np.abs(points)) == 0.5
    assert np.mean(points) == pytest.approx(0.0, abs=1e-12)


class Jumping:
    """Linear, but for events that each add to the residual on one side of a plane near the truth."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.A = rng.standard_normal((N, P))
        self.truth = rng.standard_normal(P)
        sigma = np.sqrt(np.diag(np.linalg.inv(self.A.T @ self.A)))
        self.normal = rng.standard_normal((3, P)) / sigma
        self.place = self.normal @ self.truth + rng.standard_normal(3)
        # Some three times the noise in all, half of it looking like what numbers do.
        self.event = 0.3 * self.A @ rng.standard_normal((P, 3)) + 0.3 * rng.standard_normal((N, 3))
        self.measured = self.model(self.truth) + rng.standard_normal(N)
        self.start = self.truth + sigma * rng.standard_normal(P)

    def model(self, theta: np.ndarray) -> np.ndarray:
        return self.A @ theta + self.event @ (self.normal @ theta > self.place)

    def residuals(self, points: Sequence[np.ndarray]) -> list[np.ndarray]:
        return [self.measured - self.model(theta) for theta in points]


def wide_slopes(plant: Jumping, theta: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """Central differences over five sigmas to either side."""
    ends = plant.residuals([theta + side * one for one in 5.0 * np.diag(sigma) for side in (1.0, -1.0)])
    return np.column_stack([(a - b) / (10.0 * s) for a, b, s in zip(ends[::2], ends[1::2], sigma, strict=True)])


def test_errors_are_of_the_stated_size_where_events_flip_within_the_posterior() -> None:
    at_points, over_posteriors = [], []
    for seed in range(150):
        rng = np.random.default_rng(seed)
        plant = Jumping(rng)
        exact = np.linalg.inv(plant.A.T @ plant.A + np.eye(P) / 25.0)
        sigma = np.sqrt(np.diag(exact))
        theta = plant.start
        for _ in range(4):
            J, (r,) = wide_slopes(plant, theta, sigma), plant.residuals([theta])
            C = np.linalg.inv(J.T @ J + np.eye(P) / 25.0)
            theta = theta - C @ (theta / 25.0 + J.T @ r)
        at_points.append((theta - plant.truth) ** 2 / np.diag(C))
        theta, C = plant.start, exact
        for _ in range(4):
            points, J = draws(theta, C, PARAMETERS, 64, rng), wide_slopes(plant, theta, sigma)
            theta, C = linearised(plant.residuals, J, theta, points).posterior(PARAMETERS)
        over_posteriors.append((theta - plant.truth) ** 2 / np.diag(C))
    assert np.sqrt(np.mean(at_points)) > 1.5
    assert np.sqrt(np.mean(over_posteriors)) < 1.25
    assert np.mean(np.array(over_posteriors) < 1.96**2) > 0.9
