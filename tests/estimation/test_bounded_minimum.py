"""A step of the search between bounds is the least of its quadratic there."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from kbs_process.estimation.bounded import bounded_minimum


@pytest.mark.parametrize("seed", range(40))
def test_it_is_the_bounded_minimum(seed: int) -> None:
    rng = np.random.default_rng(seed)
    J = rng.standard_normal((60, 20)) @ np.diag(10.0 ** rng.uniform(-2, 0, 20))
    J[:, 1] = J[:, 0] + 1e-3 * rng.standard_normal(60)
    z = J @ (3.0 * rng.standard_normal(20)) + rng.standard_normal(60)
    low, high = -rng.uniform(0.0, 2.0, 20), rng.uniform(0.0, 2.0, 20)
    low[3] = 0.0
    x = bounded_minimum(J.T @ J, J.T @ z, low, high)
    best = lsq_linear(J, z, (low, high + 1e-12), method="bvls", tol=1e-14).x
    for start in (x, np.clip(3.0 * rng.standard_normal(20), low, high)):
        np.testing.assert_allclose(bounded_minimum(J.T @ J, J.T @ z, low, high, start), x, rtol=1e-6, atol=1e-9)
    assert np.all((x >= low) & (x <= high))
    assert np.sum((J @ x - z) ** 2) <= np.sum((J @ best - z) ** 2) * (1.0 + 1e-9)


def test_without_bounds_in_the_way_it_is_newtons_step() -> None:
    A, b = np.array([[2.0, 0.5], [0.5, 1.0]]), np.array([1.0, -1.0])
    far = np.full(2, np.inf)
    np.testing.assert_allclose(bounded_minimum(A, b, -far, far), np.linalg.solve(A, b))
