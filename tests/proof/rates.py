"""Shares and quantiles with their intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.special import ndtri_exp
from scipy.stats import beta, binom

# Where answers cut off the p-value of a mismatch: 1e5 e-folds, once or doubled, a z of 447. That of a find may be less.
CUT_LOG10_P = (-43430.0, -43429.0)


def clopper_pearson(k: int, n: int, level: float = 0.95) -> tuple[float, float]:
    """Exact interval of a share of which k of n were seen (Clopper & Pearson, Biometrika 26, 1934).

    It covers with at least `level`, whatever the share; (0, 1) where nothing was tried.
    """
    if not 0 <= k <= n:
        raise ValueError(f"{k} of {n}")
    tail = (1.0 - level) / 2.0
    low = 0.0 if k == 0 else float(beta.ppf(tail, k, n - k + 1))
    high = 1.0 if k == n else float(beta.ppf(1.0 - tail, k + 1, n - k))
    return low, high


def median_interval(values: Sequence[float], level: float = 0.95) -> tuple[float, float, float]:
    """The median and its distribution-free interval: order statistics, from the binomial distribution.

    With fewer than six values no interval of 95 % exists; it is (-inf, inf) then.
    """
    ordered = np.sort(np.asarray(values, dtype=float))
    n = len(ordered)
    if n == 0:
        raise ValueError("no values")
    # P(x_(k+1) < median < x_(n-k)) = 1 - 2 P(B <= k), B binomial with n and 1/2.
    k = int(binom.ppf((1.0 - level) / 2.0, n, 0.5))
    while k >= 0 and 2.0 * binom.cdf(k, n, 0.5) > 1.0 - level:
        k -= 1
    low, high = (-math.inf, math.inf) if k < 0 else (float(ordered[k]), float(ordered[n - 1 - k]))
    return float(np.median(ordered)), low, high


def equivalent_distance(log10_p: float) -> float:
    """The z of a one-sided normal test with the same p-value: Q(z) = p, with p as small as 10^-100000.

    The clairvoyant detector's statistic, for an effect at distance rho, has mean rho and unit variance.
    """
    if log10_p >= 0.0:
        return -math.inf
    return -float(ndtri_exp(log10_p * math.log(10.0)))


def decibels_from_clairvoyant(rho: float, log10_p: float) -> float:
    """20 lg(rho / z): how much weaker an effect the clairvoyant needs for the same p-value; inf if z <= 0."""
    z = equivalent_distance(log10_p)
    return 20.0 * math.log10(rho / z) if z > 0.0 else math.inf
