"""A residual's linear model over where its parameters may be, and what no slope predicts as noise of its own.

A residual r(theta) that jumps (a mechanism sticks here or one tooth later) has no slope that holds over a posterior's
width, and a search for its least cost ends in dips between jumps. Over theta ~ N(theta_0, C) instead

    r(theta) = m + J (theta - theta_0) + e,   e ~ (0, Omega),   Omega = E E'

with m and Omega from draws, and e is to the estimate what noise is: the Gaussian posterior of theta has the information
J' (I + Omega)^-1 J + P, and its mean is one step away. Repeated where that leads, this is posterior linearisation
(A. F. Garcia-Fernandez, L. Svensson, M. R. Morelande, S. Sarkka, Posterior linearization filter: principles and
implementation using sigma points, IEEE Trans. Signal Processing 63 (2015) 5561).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from kbs_process.estimation.fit import Parameters
from kbs_process.signals.records import Array


@dataclass(frozen=True, slots=True, eq=False)
class Unpredicted:
    """Covariance I + E E' of a residual: unit noise, and what slopes do not predict."""

    E: Array  # (n, k)

    def whitened(self, r: Array) -> Array:
        """Residuals or slopes (n,) or (n, p) as (n + k,) or (n + k, p) with unit covariance.

        They are r less E v, then v, with v what minimises |r - E v|^2 + |v|^2, which is r' (I + E E')^-1 r.
        """
        gram = np.eye(self.E.shape[1]) + self.E.T @ self.E
        v = np.linalg.solve(gram, self.E.T @ r)
        return np.concatenate([r - self.E @ v, v])


@dataclass(frozen=True, slots=True, eq=False)
class Linearised:
    """A residual about theta_0 (p,): r = mean + slopes (theta - theta_0), whitened by what they do not predict."""

    at: Array  # (p,) theta_0
    mean: Array  # (n + k,)
    slopes: Array  # (n + k, p)
    unpredicted: Unpredicted

    def posterior(self, parameters: Parameters) -> tuple[Array, Array]:
        """Mean (p,) and covariance (p, p) with the priors of `parameters`; bounds do not count."""
        precision = parameters.sigma**-2.0
        C = np.asarray(np.linalg.inv(self.slopes.T @ self.slopes + np.diag(precision)), dtype=np.float64)
        gradient = self.slopes.T @ self.mean + (self.at - parameters.value) * precision
        return self.at - C @ gradient, C


def draws(theta: Array, C: Array, parameters: Parameters, count: int, rng: np.random.Generator) -> list[Array]:
    """`count` (even) points of N(theta, C) in pairs about theta, brought within bounds."""
    root = np.linalg.cholesky(C)
    half = [root @ rng.standard_normal(len(theta)) for _ in range(count // 2)]
    points = [theta + side * one for one in half for side in (1.0, -1.0)]
    return [parameters.clipped(point) for point in points]


def linearised(
    residuals: Callable[[Sequence[Array]], list[Array]], J: Array, theta: Array, points: Sequence[Array]
) -> Linearised:
    """Linearise about `theta` with slopes J (n, p), taken over a distance like that of `points`, which are its draws.

    Omega has the rank of the draws: what it lacks is small where few events happen, each in many of the draws.
    """
    left = [r - J @ (at - theta) for at, r in zip(points, residuals(points), strict=True)]
    mean = np.mean(left, axis=0)
    unpredicted = Unpredicted((np.column_stack(left) - mean[:, None]) / np.sqrt(len(points) - 1))
    return Linearised(theta, unpredicted.whitened(mean), unpredicted.whitened(J), unpredicted)
