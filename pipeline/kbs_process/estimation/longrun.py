"""Long-run covariance of correlated scores: what a mean over coloured samples is really known to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kbs_process.signals.records import Array

_LARGEST_AR = 0.97


def longrun_covariance(scores: Array, series: Sequence[tuple[int, int]]) -> Array:
    """Covariance (p, p) of the sum of scores (n, p) over independent `series` of (samples, channels).

    Scores of one instant are added over channels, pre-whitened by one first-order
    autoregression, summed with Bartlett weights to lag 4 (n/100)^(2/9), and recoloured (Andrews and Monahan,
    Econometrica 60:953, 1992). Valid for stationary residuals with a memory well below the record's length.
    """
    total = np.zeros((scores.shape[1], scores.shape[1]))
    start = 0
    for samples, channels in series:
        block = scores[start : start + samples * channels].reshape(samples, channels, -1).sum(axis=1)
        start += samples * channels
        total += _one_series(block)
    if start != len(scores):
        raise ValueError(f"series cover {start} of {len(scores)} residuals")
    return total


def _one_series(u: Array) -> Array:
    n = len(u)
    if n < 8:
        return u.T @ u
    # One coefficient for all: a combination of parameters that moves nothing must keep a score of zero.
    power = np.sum(u**2, axis=0)
    each = np.sum(u[1:] * u[:-1], axis=0)[power > 0.0] / power[power > 0.0]
    rho = float(np.clip(np.mean(each), -_LARGEST_AR, _LARGEST_AR)) if len(each) else 0.0
    e = u[1:] - rho * u[:-1]
    lags = min(int(4 * (n / 100) ** (2 / 9)), n // 4)
    S = e.T @ e
    for lag in range(1, lags + 1):
        gamma = e[lag:].T @ e[:-lag]
        S += (1.0 - lag / (lags + 1)) * (gamma + gamma.T)
    S_full: Array = S / (1.0 - rho) ** 2 * (n / (n - 1))
    return S_full


def variance_inflation(residual: Array) -> Array:
    """How many times the variance of a mean exceeds that of white samples, (n, c) -> (c,), at least 1.

    First-order autoregression: (1 + rho) / (1 - rho).
    """
    centred = residual - residual.mean(axis=0)
    power = np.sum(centred**2, axis=0)
    rho = np.sum(centred[1:] * centred[:-1], axis=0) / np.where(power > 0.0, power, 1.0)
    rho = np.clip(rho, 0.0, _LARGEST_AR)
    inflation: Array = (1.0 + rho) / (1.0 - rho)
    return inflation
