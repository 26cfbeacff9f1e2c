"""The chart of amplitude and phase: there and back, slopes, and a search that starts half a turn off."""

from __future__ import annotations

import numpy as np
import pytest

from kbs_process.estimation.fit import Parameters, difference_jacobian, fit_map
from kbs_process.identification.polar import Polar
from kbs_process.identification.screening import Phase

T = np.linspace(0.0, 4.0 * np.pi, 300)
PARAMETERS = Parameters(
    ("amplitude", "phase", "offset"),
    np.array([0.5, 0.0, 0.0]),
    np.array([0.2, np.inf, 1.0]),
    np.array([0.0, -np.inf, -np.inf]),
    np.full(3, np.inf),
)
POLAR = Polar.of([Phase(phase=1, amplitude=0, smooth=True)], PARAMETERS)


def residual(theta: np.ndarray) -> np.ndarray:
    y = 0.8 * np.sin(T + 2.5) + 0.1
    return (y - theta[0] * np.sin(T + theta[1]) - theta[2]) / 0.01


def test_there_and_back() -> None:
    theta = np.array([0.3, -2.0, 7.0])
    np.testing.assert_allclose(POLAR.back(POLAR.flat(theta)), theta, rtol=1e-14)


def test_slopes_are_those_of_residual_and_prior() -> None:
    theta = np.array([0.3, -2.0, 0.2])

    def whole(u: np.ndarray) -> np.ndarray:
        at = POLAR.back(u)
        return np.concatenate([residual(at), POLAR.excess(at)])

    J = POLAR.jacobian(difference_jacobian(residual, theta, np.ones(3)), theta)
    np.testing.assert_allclose(J, difference_jacobian(whole, POLAR.flat(theta), np.ones(3) * 0.01), atol=2e-3)


def test_search_passes_through_amplitude_zero() -> None:
    start = np.array([0.5, 2.5 - np.pi, 0.0])

    def whole(u: np.ndarray) -> np.ndarray:
        at = POLAR.back(u)
        return np.concatenate([residual(at), POLAR.excess(at)])

    def slopes(u: np.ndarray) -> np.ndarray:
        at = POLAR.back(u)
        return POLAR.jacobian(difference_jacobian(residual, at, np.ones(3)), at)

    fit = fit_map(whole, POLAR.flat_parameters, jacobian=slopes, start=POLAR.flat(start), iterations=20)
    found = POLAR.back(fit.value)
    assert fit.checks[0].passed
    assert found[0] == pytest.approx(0.8, abs=1e-3)  # the prior holds it by (0.3/0.2)^2 against some thousands
    assert found[1] == pytest.approx(2.5, abs=1e-3)
    assert found[2] == pytest.approx(0.1, abs=1e-3)
