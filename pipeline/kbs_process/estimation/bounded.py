"""Least squares between bounds, on the normal equations."""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from kbs_process.signals.records import Array


def bounded_minimum(A: Array, b: Array, low: Array, high: Array, start: Array | None = None) -> Array:
    """Return x (p,) that minimises x' A x / 2 - b' x between bounds around zero; A (p, p) is positive definite.

    `start` (p,), between bounds too, is where it is looked for from, else zero: what the same bounds hold is found at
    once.
    Source: the active set of P. B. Stark and R. L. Parker, Bounded-variable least squares, Comput. Stat. 10:129 (1995).
    """
    x = np.zeros(len(b)) if start is None else start.copy()
    free = np.ones(len(b), dtype=np.bool_) if start is None else (low < x) & (x < high)
    for _ in range(4 * len(b)):
        target = x.copy()
        pull = b[free] - A[np.ix_(free, ~free)] @ x[~free]
        target[free] = cho_solve(cho_factor(A[np.ix_(free, free)]), pull)
        way = target - x
        with np.errstate(divide="ignore", invalid="ignore"):
            shares = np.where(way > 0.0, (high - x) / way, np.where(way < 0.0, (low - x) / way, np.inf))
        first = int(np.argmin(np.where(free, shares, np.inf)))
        if shares[first] < 1.0:
            x = np.clip(x + shares[first] * way, low, high)
            # On the bound, and not within it by a rounding: there it would never be let go again.
            x[first] = high[first] if way[first] > 0.0 else low[first]
            free[first] = False
            continue
        x = target
        slope = b - A @ x
        outward = np.where(x <= low, slope, np.where(x >= high, -slope, 0.0)) * ~free
        worst = int(np.argmax(outward))
        if outward[worst] <= 1e-9 * np.abs(b).max():
            break
        free[worst] = True
    return x
