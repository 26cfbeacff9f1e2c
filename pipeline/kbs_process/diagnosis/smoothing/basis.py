"""Motion by coefficients of which each sample sees five: values, rates and accelerations are local."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

from kbs_process.signals.records import Array

# Of what is compared: whole up to the first, nothing from the second on. An edge would part what a resonance near it
# shows while the mechanism turns, and its stiffness and damping with it.
WHOLE_HZ, BAND_HZ = 6.0, 8.0
LOCAL = 5  # coefficients that a sample sees
# Of these a sample's value, and its rate and acceleration in samples: exact for what is slow, within 0.7 % up to 0.4 of
# the sampling rate, where slopes of a spline of the fifth degree are wrong by 20 and 11 %.
# Kind of scheme: S. K. Lele, Compact finite difference schemes with spectral-like resolution, J. Comput. Phys. 103
# (1992) 16; numbers by least squares of high order over the band.
_DIFFERENCES = np.array([
    [0.04003587, 0.50015031, 1.0, 0.50015031, 0.04003587],
    [-0.16100329, -0.71817961, 0.0, 0.71817961, 0.16100329],
    [0.47044569, 0.1985896, -1.33807058, 0.1985896, 0.47044569],
])  # fmt: skip


def in_band(values: Array, dt: float, undo: Callable[[Array], Array] | None = None) -> Array:
    """Values (n, ...), dt s apart, less what lies beyond the band; `undo` are factors over frequency, Hz.

    A line from the first to the last sample is taken apart, and what is left is mirrored. Whatever is compared goes
    through here: what a working rate's filter lets through beyond the band is in part another frequency's.
    """
    n, rest = len(values), (1,) * (values.ndim - 1)
    line = values[:1] + (values[-1:] - values[:1]) * np.linspace(0.0, 1.0, n).reshape(-1, *rest)
    spectrum = np.fft.rfft(np.concatenate([values - line, (line - values)[::-1]]), axis=0)
    f = np.fft.rfftfreq(2 * n, dt)
    beyond = np.clip((f - WHOLE_HZ) / (BAND_HZ - WHOLE_HZ), 0.0, 1.0)
    factors = 0.5 * (1.0 + np.cos(np.pi * beyond)) * (1.0 if undo is None else undo(np.asarray(f, dtype=np.float64)))
    return np.asarray(np.fft.irfft(spectrum * factors.reshape(-1, *rest), 2 * n, axis=0)[:n] + line)


class Basis:
    """The basis on n samples dt apart; coefficients are (size, freedoms)."""

    def __init__(self, n: int, dt: float) -> None:
        self.size = n - 1 + LOCAL
        self.values = _DIFFERENCES / dt ** np.arange(3.0)[:, None]
        self._n = n

    def motion(self, coefficients: Array) -> tuple[Array, Array, Array]:
        """Values, rates and accelerations (n, freedoms)."""
        values, rates, accelerations = (
            sum(basis[a] * coefficients[a : a + self._n] for a in range(LOCAL)) for basis in self.values
        )
        return values, rates, accelerations

    def fitted(self, values: Array) -> Array:
        """Coefficients whose values at the samples are `values` (n, freedoms)."""
        basis, n = self.values[0], len(values)
        banded = np.zeros((LOCAL, self.size))
        for a in range(LOCAL):
            for b in range(a, LOCAL):
                banded[b - a, a : a + n] += basis[a] * basis[b]
        banded[0] += 1e-7 * banded[0].max()
        middle = np.arange(self.size) - (LOCAL - 1) / 2
        near = np.stack([np.interp(middle, np.arange(n), column) for column in values.T], axis=1)
        left = values - sum(basis[a] * near[a : a + n] for a in range(LOCAL))
        right = np.zeros_like(near)
        for a in range(LOCAL):
            right[a : a + n] += basis[a] * left
        return np.asarray(near + cho_solve_banded((cholesky_banded(banded, lower=True), True), right))
