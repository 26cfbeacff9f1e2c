"""Gauss-Newton descent with slopes taken once: a step costs one residual, however many parameters there are.

The cost is that of `estimation.fit`. Slopes J are those at the start; where the residual bends, a step gains less than
they promise, and the descent ends: the caller takes them anew (a chord method: Kelley, Iterative Methods for Linear and
Nonlinear Equations, SIAM 1995, section 5.4). It converges to where J'r + P (theta - theta_0) = 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from kbs_process.estimation.fit import Parameters, Residual, damped_step, triangle
from kbs_process.signals.records import Array

_STALE = 0.3  # of what was promised: a step that gains less ends the descent
_DAMPING = 1e-3  # first, of the squared lengths of the slopes; ten times that after each step that fails


@dataclass(frozen=True, slots=True, eq=False)
class Descent:
    """Where a descent led."""

    value: Array  # (p,)
    promised: float  # by the slopes, of the cost, for the first step: none is due where this is small
    gained: float


def descend(residual: Residual, J: Array, parameters: Parameters, start: Array, *, gain: float, steps: int) -> Descent:
    """Go down from `start` with slopes J (n, p) until a step promises less than `gain`, at most `steps` residuals."""
    scale, root = parameters.scale, 1.0 / parameters.sigma
    R = triangle(np.vstack([J, np.diag(root)]) * scale)

    def augmented(theta: Array) -> tuple[Array, Array, float]:
        misfit, excess = residual(theta), (theta - parameters.value) * root
        return misfit, excess, float(misfit @ misfit + excess @ excess)

    theta = parameters.clipped(start)
    misfit, excess, cost = augmented(theta)
    first, begin, damping = -1.0, cost, 0.0
    for _ in range(steps):
        gradient = scale * (J.T @ misfit + root * excess)
        rhs = -np.asarray(solve_triangular(R, gradient, trans="T"), dtype=np.float64)
        candidate = damped_step(R, rhs, damping, theta, parameters)
        left = rhs - R @ ((candidate - theta) / scale)
        promised = float(rhs @ rhs - left @ left)
        first = promised if first < 0.0 else first
        if promised < gain:
            break
        *new, new_cost = augmented(candidate)
        gained = cost - new_cost
        if not gained > 0.0:
            damping = max(10.0 * damping, _DAMPING)
            continue
        theta, (misfit, excess), cost = candidate, new, new_cost
        if gained < _STALE * promised:
            break
        damping *= 0.1 if damping > _DAMPING else 0.0
    return Descent(theta, first, begin - cost)
