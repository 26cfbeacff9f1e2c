"""Descents with slopes held: they reach what renewed ones reach, stay within bounds, and never go up."""

from __future__ import annotations

import numpy as np
import pytest

from kbs_process.estimation.descent import descend
from kbs_process.estimation.fit import Parameters, difference_jacobian, fit_map
from kbs_process.results.parallel import Crew

T = np.linspace(0.0, 1.0, 100)
PARAMETERS = Parameters(
    ("a", "b"), np.array([0.0, 1.0]), np.array([2.0, 0.5]), np.array([-9.0, 0.0]), np.array([9.0, 9.0])
)


def residual(theta: np.ndarray) -> np.ndarray:
    y = 1.3 + np.exp(-1.4 * T) + 0.01 * np.cos(40.0 * T)
    return (y - theta[0] - np.exp(-theta[1] * T)) / 0.01


def slopes(theta: np.ndarray) -> np.ndarray:
    return difference_jacobian(residual, theta, np.ones(2))


def test_held_slopes_lead_where_renewed_ones_lead() -> None:
    begin = np.array([1.2, 1.2])
    found = descend(residual, slopes(begin), PARAMETERS, begin, gain=1e-9, steps=30)
    best = fit_map(residual, PARAMETERS, start=begin)
    # Of the chord method's fixed point, J'r = 0 with the slopes of the start: off by their change times the residual.
    np.testing.assert_allclose(found.value, best.value, atol=0.3 * best.sigma.min())
    assert found.gained > 0.0
    again = descend(residual, slopes(found.value), PARAMETERS, found.value, gain=1.0, steps=3)
    assert again.promised < 1.0
    np.testing.assert_array_equal(again.value, found.value)


def test_bounds_hold_and_the_other_follows() -> None:
    near = Parameters(
        PARAMETERS.names, PARAMETERS.value, PARAMETERS.sigma, np.array([-9.0, 0.0]), np.array([9.0, 1.25])
    )
    begin = np.array([1.2, 1.2])
    found = descend(residual, slopes(begin), near, begin, gain=1e-9, steps=30)
    assert found.value[1] == 1.25
    held = residual(found.value)
    assert np.sum(held**2) < np.sum(residual(np.array([1.2, 1.25])) ** 2)


def test_it_counts_its_residuals_and_never_goes_up() -> None:
    calls: list[np.ndarray] = []

    def counted(theta: np.ndarray) -> np.ndarray:
        calls.append(theta)
        return residual(theta)

    wrong = -slopes(PARAMETERS.value)  # every step goes uphill
    found = descend(counted, wrong, PARAMETERS, PARAMETERS.value, gain=1e-9, steps=4)
    assert len(calls) == 5
    assert found.gained == 0.0
    np.testing.assert_array_equal(found.value, PARAMETERS.value)


def scaled(held: float, piece: float) -> float:
    return held * piece


@pytest.mark.parametrize("processes", [1, 2])
def test_a_crew_keeps_order_and_what_it_holds(processes: int) -> None:
    with Crew(0.1, processes) as crew:
        first = list(crew.map(scaled, [3.0, 1.0, 2.0]))
        assert first == [0.1 * 3.0, 0.1 * 1.0, 0.1 * 2.0]
        assert list(crew.map(scaled, [7.0])) == [0.1 * 7.0]
