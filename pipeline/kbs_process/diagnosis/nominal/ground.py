"""The cost around a place as slopes there have it, and its minimum between bounds, damped or not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from kbs_process.estimation.bounded import bounded_minimum
from kbs_process.signals.records import Array, Mask

if TYPE_CHECKING:
    from kbs_process.diagnosis.nominal.costs import Predictions
    from kbs_process.diagnosis.nominal.tangents import Tangents

_RIDGE = 1e-10  # of unit columns: numbers that nothing shows would leave the equations singular


class Ground:
    """Normal equations of data that count `weight` times, and of the prior, in the chart of cosines and sines.

    With slopes J (rows, p) of each trial, whitened, and the chart's T (p, u) at the place, A = T' (w J'J + P) T, scaled
    to a unit diagonal. They hold for other points, too, as far as slopes are the same there.
    """

    def __init__(self, search: Tangents, theta: Array, J: Mapping[int, Array], weight: float) -> None:
        self.search, self.theta, self.J, self.weight = search, theta, J, weight
        self.T = search.polar.jacobian(np.eye(len(theta)), theta)[: len(theta)]
        self.information = information(J)
        A = self.T.T @ (weight * self.information + np.diag(search.precision + search.ridge)) @ self.T
        self.scale = 1.0 / np.sqrt(np.maximum(np.diag(A), 1e-300))
        self.A = A * np.outer(self.scale, self.scale)

    def pull(self, theta: Array, predicted: Predictions) -> Array:
        """(u,) minus half the slope of the cost at a point (p,), at which `predicted` holds."""
        search = self.search
        data = sum(j.T @ search.residual(k, predicted) for k, j in self.J.items())
        prior = search.precision * (theta - search.parameters.value)
        return np.asarray(self.scale * (self.T.T @ (self.weight * data - prior)), dtype=np.float64)

    def minimum(self, theta: Array, pull: Array, damping: float = 0.0) -> tuple[Array, float]:
        """The point (p,) where the cost is least from `theta` on, which is pulled so, and what it promises.

        `damping` is Levenberg's and Marquardt's: 0 for the step of Gauss and Newton.
        """
        search = self.search
        low, high = search.room(theta)
        du = bounded_minimum(self.A + (_RIDGE + damping) * np.eye(len(pull)), pull, low / self.scale, high / self.scale)
        point = search.clipped(search.polar.back(search.polar.flat(theta) + self.scale * du))
        return point, float(2.0 * pull @ du - du @ self.A @ du) / self.weight

    def valleys(self, among: Mask, share: float, length: float) -> list[Array]:
        """Points (p,), some standard deviations off along principal directions with an eigenvalue below `share`.

        Of the numbers `among` (p,), while the others stay. Of one that nothing shows, no standard deviation is known.
        """
        search = self.search
        here = search.polar.flat(self.theta)
        low, high = search.room(self.theta)
        points = list[Array]()
        if not (among.any() and np.isfinite(self.A).all()):
            return points
        for value, direction in zip(*_principal(self.A[np.ix_(among, among)]), strict=True):
            if _RIDGE < value < share:
                du = np.zeros(len(here))
                du[among] = self.scale[among] * direction * (length / np.sqrt(value))
                points.append(search.clipped(search.polar.back(here + np.clip(du, low, high))))
        return points


def information(J: Mapping[int, Array]) -> Array:
    """(p, p) of all trials' slopes together."""
    return np.asarray(sum(j.T @ j for j in J.values()), dtype=np.float64)


def _principal(A: Array) -> tuple[Array, Array]:
    """Eigenvalues (u,) from the least on, and eigenvectors, one in each row, with their largest element positive."""
    values, vectors = np.linalg.eigh(A)
    largest = np.argmax(np.abs(vectors), axis=0)
    return values, (vectors * np.sign(vectors[largest, np.arange(len(values))])).T
