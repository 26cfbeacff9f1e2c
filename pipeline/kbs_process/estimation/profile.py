"""Profile likelihood: how far one parameter can go while all others follow as best they can.

D(x) = min over the others of cost(theta, theta_i = x), less the least cost, cost being -2 log posterior. The interval
with D <= 3.84 holds the parameter with 95 % (Wilks), also where the cost is no parabola and a covariance misleads.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from kbs_process.estimation.fit import Fit, Parameters
from kbs_process.signals.records import Array

LEVEL_95 = 3.841  # chi-square, one degree of freedom
_LEAST, _MOST = 0.25, 4.0  # of the first guess: how far from it an end is looked for

Residuals = Callable[[Sequence[Array]], list[Array]]


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """Points of one parameter's profile, ascending, and the 95 % interval that they give."""

    name: str
    x: Array  # (k,)
    D: Array  # (k,)
    low: float
    high: float


def profiles(
    names: Sequence[str], fit: Fit, parameters: Parameters, residuals: Residuals, J: Array
) -> tuple[Profile, ...]:
    """Profile each of `names` with two points a side; J (n, p) is the Jacobian of the residual at the estimate.

    At each point the others start where the linear model wants them and are corrected by one Gauss-Newton step with J
    as it is: their remaining distance from the minimum is of third order in the point's own distance. The second point
    of a side lies where a parabola through the first has D = 3.84; the end is interpolated in the root of D.
    """
    precision = parameters.sigma**-2.0
    C = np.asarray(np.linalg.inv(J.T @ J + np.diag(precision)), dtype=np.float64)
    least = _costs([fit.value], residuals([fit.value]), parameters)[0]
    sides = [(fit.names.index(name), side) for name in names for side in (-1.0, 1.0)]
    reach = [np.sqrt(LEVEL_95 * C[index, index]) for index, _ in sides]
    points: list[list[tuple[float, float]]] = [[(0.0, 0.0)] for _ in sides]
    for _ in range(2):
        at = [
            parameters.clipped(fit.value + C[:, i] / C[i, i] * side * r)
            for (i, side), r in zip(sides, reach, strict=True)
        ]
        first = residuals(at)
        corrected = [
            parameters.clipped(theta + _others_step(C, J, r, theta, parameters, i))
            for theta, r, (i, _) in zip(at, first, sides, strict=True)
        ]
        before, after = _costs(at, first, parameters), _costs(corrected, residuals(corrected), parameters)
        for k, (i, _) in enumerate(sides):
            D = float(min(before[k], after[k])) - least
            points[k].append((float(corrected[k][i] - fit.value[i]), D))
            guess = np.sqrt(LEVEL_95 / D) if D > 0.0 else _MOST
            reach[k] = reach[k] * float(np.clip(guess, _LEAST, _MOST))
    found = []
    for k in range(0, len(sides), 2):
        i = sides[k][0]
        known = sorted({*points[k], *points[k + 1]})
        x = fit.value[i] + np.array([distance for distance, _ in known])
        ends = [fit.value[i] + side * _end(points[k + (side > 0)]) for side in (-1, 1)]
        found.append(Profile(fit.names[i], x, np.array([D for _, D in known]), float(ends[0]), float(ends[1])))
    return tuple(found)


def _costs(thetas: Sequence[Array], residuals: Sequence[Array], parameters: Parameters) -> list[float]:
    return [
        float(r @ r + np.sum(((theta - parameters.value) / parameters.sigma) ** 2))
        for theta, r in zip(thetas, residuals, strict=True)
    ]


def _others_step(C: Array, J: Array, r: Array, theta: Array, parameters: Parameters, index: int) -> Array:
    """Gauss-Newton step of all parameters but one."""
    g = J.T @ r + (theta - parameters.value) / parameters.sigma**2
    free = C @ g
    step: Array = -(free - C[:, index] * (free[index] / C[index, index]))
    return step


def _end(points: Sequence[tuple[float, float]]) -> float:
    """Distance at which the root of D, linear between the points and beyond, reaches that of 3.84."""
    ordered = sorted((abs(distance), np.sqrt(max(D, 0.0))) for distance, D in points)
    (d0, s0), (d1, s1) = ordered[-2:]
    wanted = float(np.sqrt(LEVEL_95))
    if len(ordered) > 2 and s0 >= wanted:
        (d0, s0), (d1, s1) = ordered[0], ordered[1]
    return d1 if s1 <= s0 else float(d0 + (wanted - s0) * (d1 - d0) / (s1 - s0))
