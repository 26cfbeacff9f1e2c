"""Motion as uniform B-splines of the fifth degree with a knot a sample: values, rates and accelerations are local."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.linalg import cho_solve_banded, cholesky_banded

from proof.rivals.case import Array

DEGREE = 5
BAND_HZ = 8.0  # of what is compared: as many independent numbers twice a second
LOCAL = DEGREE + 1  # coefficients that a sample sees


def in_band(values: Array, dt: float, undo: Callable[[Array], Array] | None = None) -> Array:
    """Values (n, ...), dt s apart, without what lies beyond the band; `undo` are factors over frequency, Hz.

    A line from the first to the last sample is taken apart, and what is left is mirrored. Whatever is compared goes
    through here: what a working rate's filter lets through beyond the band is in part another frequency's.
    """
    n, rest = len(values), (1,) * (values.ndim - 1)
    line = values[:1] + (values[-1:] - values[:1]) * np.linspace(0.0, 1.0, n).reshape(-1, *rest)
    spectrum = np.fft.rfft(np.concatenate([values - line, (line - values)[::-1]]), axis=0)
    f = np.fft.rfftfreq(2 * n, dt)
    factors = (f <= BAND_HZ) * (1.0 if undo is None else undo(f))
    return np.asarray(np.fft.irfft(spectrum * factors.reshape(-1, *rest), 2 * n, axis=0)[:n] + line)


class Splines:
    """The basis on n samples dt apart; coefficients are (size, freedoms)."""

    def __init__(self, n: int, dt: float) -> None:
        self.size = n - 1 + DEGREE
        first = np.minimum(np.arange(n), n - 2)
        self.first: NDArray[np.intp] = first  # of the coefficients that a sample sees
        within = np.arange(n) - first
        bell = BSpline.basis_element(np.arange(LOCAL + 1.0))
        slopes = [bell, bell.derivative(1), bell.derivative(2)]
        at = np.clip(within[:, None] + DEGREE - np.arange(LOCAL), 1e-12, LOCAL - 1e-12)
        self.values = np.stack([slope(at) / dt**k for k, slope in enumerate(slopes)])  # (3, n, LOCAL)
        self._seen = first[:, None] + np.arange(LOCAL)

    def motion(self, coefficients: Array) -> tuple[Array, Array, Array]:
        """Values, rates and accelerations (n, freedoms)."""
        local = coefficients[self._seen]
        values, rates, accelerations = (np.einsum("na,nad->nd", basis, local) for basis in self.values)
        return values, rates, accelerations

    def fitted(self, values: Array) -> Array:
        """Coefficients whose values at the samples are `values` (n, freedoms)."""
        basis = self.values[0]
        banded = np.zeros((LOCAL, self.size))
        for a in range(LOCAL):
            for b in range(a, LOCAL):
                np.add.at(banded[b - a], self._seen[:, a], basis[:, a] * basis[:, b])
        banded[0] += 1e-7 * banded[0].max()
        middle = np.arange(self.size) - (DEGREE - 1) / 2
        near = np.stack([np.interp(middle, np.arange(len(values)), column) for column in values.T], axis=1)
        left = values - np.einsum("na,nad->nd", basis, near[self._seen])
        right = np.zeros_like(near)
        for a in range(LOCAL):
            np.add.at(right, self._seen[:, a], basis[:, a, None] * left)
        return np.asarray(near + cho_solve_banded((cholesky_banded(banded, lower=True), True), right))
