"""Recursions over samples that hysteresis and play need."""

from __future__ import annotations

from math import exp

import numpy as np
from numba import njit

from kbs_process.signals.records import Array


@njit(cache=True, error_model="numpy")
def strained(x: Array, displacement: float) -> Array:
    r"""Strain z (n,) of P. R. Dahl's bristles along x (n,), from z = 0: its magnitude stays below 1.

    Equation: $dz/dx = (1 - z \operatorname{sign} dx) / x_0$, exactly: between two samples z approaches the sign of the
        change with $e^{-|\Delta x| / x_0}$.
    """
    z = np.zeros_like(x)
    for k in range(1, len(x)):
        change = x[k] - x[k - 1]
        sense = 1.0 if change > 0.0 else -1.0
        z[k] = sense + (z[k - 1] - sense) * exp(-abs(change) / displacement)
    return z


@njit(cache=True, error_model="numpy")
def stopped(x: Array, displacement: float) -> Array:
    r"""Prandtl's stop z (n,) along x (n,), from z = 0: it follows x until it stands at -1 or 1.

    Equation: $z_k = \max(-1, \min(1, z_{k-1} + (x_k - x_{k-1}) / x_0))$, exact between two samples.
    """
    z = np.zeros_like(x)
    for k in range(1, len(x)):
        z[k] = max(-1.0, min(1.0, z[k - 1] + (x[k] - x[k - 1]) / displacement))
    return z
