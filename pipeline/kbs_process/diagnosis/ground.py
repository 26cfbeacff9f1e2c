"""The cost around a place as slopes there have it, and its minimum between bounds, damped or not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from kbs_process.estimation.bounded import bounded_minimum
from kbs_process.signals.records import Array

if TYPE_CHECKING:
    from kbs_process.diagnosis.search import Predictions, Search

_RIDGE = 1e-10  # of unit columns: numbers that nothing shows would leave the equations singular


class Ground:
    """Normal equations of data that count `weight` times, and of the prior, in the chart of cosines and sines.

    With slopes J (rows, p) of each trial, whitened, and the chart's T (p, u) at the place, A = T' (w J'J + P) T, scaled
    to a unit diagonal. They hold for other points, too, as far as slopes are the same there.
    """

    def __init__(self, search: Search, theta: Array, J: Mapping[int, Array], weight: float) -> None:
        self.search, self.J, self.weight = search, J, weight
        self.T = search.polar.jacobian(np.eye(len(theta)), theta)[: len(theta)]
        data = weight * information(J)
        A = self.T.T @ (data + np.diag(search.precision + search.ridge)) @ self.T
        self.scale = 1.0 / np.sqrt(np.maximum(np.diag(A), 1e-300))
        self.A = A * np.outer(self.scale, self.scale)

    def minimum(self, theta: Array, predicted: Predictions, damping: float = 0.0) -> tuple[Array, float]:
        """The point (p,) where the cost is least from `theta` on, at which `predicted` holds, and what it promises.

        `damping` is Levenberg's and Marquardt's: 0 for the step of Gauss and Newton.
        """
        search = self.search
        data = sum(j.T @ search.residual(k, predicted) for k, j in self.J.items())
        prior = search.precision * (theta - search.parameters.value)
        b = self.scale * (self.T.T @ (self.weight * data - prior))
        low, high = search.room(theta)
        du = bounded_minimum(
            self.A + (_RIDGE + damping) * np.eye(len(b)), b, low / self.scale, high / self.scale
        )
        point = search.clipped(search.polar.back(search.polar.flat(theta) + self.scale * du))
        return point, float(2.0 * b @ du - du @ self.A @ du) / self.weight


def information(J: Mapping[int, Array]) -> Array:
    """(p, p) of all trials' slopes together."""
    return np.asarray(sum(j.T @ j for j in J.values()), dtype=np.float64)
