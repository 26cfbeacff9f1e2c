"""Profile intervals: the exact ones of a linear model, and lopsided where the model is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from kbs_process.estimation.fit import Parameters, difference_jacobian, fit_map
from kbs_process.estimation.profile import profiles

pytestmark = pytest.mark.slow

T = np.linspace(0.0, 1.0, 200)


def test_linear_model_has_the_intervals_of_its_covariance() -> None:
    y = 1.0 + 2.0 * T + np.random.default_rng(1).standard_normal(len(T))
    parameters = Parameters(("a", "b"), np.zeros(2), np.array([np.inf, 3.0]))

    def residual(theta: np.ndarray) -> np.ndarray:
        return y - theta[0] - theta[1] * T

    fit = fit_map(residual, parameters)
    J = difference_jacobian(residual, fit.value, parameters.scale)
    for found in profiles(("a", "b"), fit, parameters, lambda many: [residual(one) for one in many], J):
        half = 1.96 * fit.sigma[fit.names.index(found.name)]
        assert (found.high - found.low) / 2.0 == pytest.approx(half, rel=1e-3)
        assert (found.high + found.low) / 2.0 == pytest.approx(fit[found.name], abs=1e-3 * half)


def test_square_of_a_parameter_makes_the_profile_lopsided() -> None:
    y = 0.3**2 * T + 0.05 * np.random.default_rng(2).standard_normal(len(T))
    parameters = Parameters(("c",), np.array([0.5]), np.array([np.inf]))

    def residual(theta: np.ndarray) -> np.ndarray:
        return (y - theta[0] ** 2 * T) / 0.05

    def batch(many: Sequence[np.ndarray]) -> list[np.ndarray]:
        return [residual(one) for one in many]

    fit = fit_map(residual, parameters)
    (found,) = profiles(("c",), fit, parameters, batch, difference_jacobian(residual, fit.value, np.ones(1)))
    square = np.array([found.low, found.high]) ** 2 - fit["c"] ** 2
    half = 1.96 * 0.05 / np.linalg.norm(T)
    np.testing.assert_allclose(square, [-half, half], rtol=0.03)


def test_search_follows_a_bound_and_says_so() -> None:
    y = -0.5 + 2.0 * T
    parameters = Parameters(
        ("a", "b"), np.array([0.5, 0.0]), np.full(2, np.inf), np.array([0.0, -9.0]), np.array([9.0, 9.0])
    )
    fit = fit_map(lambda theta: (y - theta[0] - theta[1] * T) / 0.01, parameters)
    assert fit["a"] == 0.0
    assert fit["b"] == pytest.approx(y @ T / (T @ T), rel=1e-6)
    assert not fit.checks[1].passed
