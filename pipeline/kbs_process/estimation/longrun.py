"""Long-run covariance of correlated scores: what a mean over coloured samples is really known to."""

from __future__ import annotations

import numpy as np
from scipy.fft import next_fast_len, rfft

from kbs_process.signals.records import Array

_LARGEST_AR = 0.97
_RECORD_PER_MEMORY = 10  # the record is this many times as long as the memory that is looked for
_STRETCH = 1.330  # ((1.96 + 2.9694 b + 0.4160 b^2 - 0.5324 b^3) / 1.96)^2 at b = 1/10


def longrun_covariance(scores: Array) -> Array:
    """Covariance (p, p) of the sum of scores (n, p), one of each instant of a record.

    They are pre-whitened by one first-order autoregression (Andrews and
    Monahan, Econometrica 60:953, 1992), summed with Bartlett weights to a tenth of the record (Kiefer and
    Vogelsang, Econometric Theory 21:1130, 2005), and recoloured. A memory that grows with the record keeps what
    shorter ones miss: 1/f noise and drift below white noise. So long a memory leaves the estimate few degrees of
    freedom; it is stretched so that +- 1.96 sigma still covers 95 %, by their factor for the Bartlett kernel.
    """
    n = len(scores)
    if n < 8:
        return scores.T @ scores
    # One coefficient for all: a combination of parameters that moves nothing must keep a score of zero.
    power = np.sum(scores**2, axis=0)
    each = np.sum(scores[1:] * scores[:-1], axis=0)[power > 0.0] / power[power > 0.0]
    rho = float(np.clip(np.mean(each), -_LARGEST_AR, _LARGEST_AR)) if len(each) else 0.0
    e = scores[1:] - rho * scores[:-1]
    S = _STRETCH * _bartlett(e, max(1, n // _RECORD_PER_MEMORY))
    S_full: Array = S / (1.0 - rho) ** 2 * (n / (n - 1))
    return S_full


def _bartlett(e: Array, lags: int) -> Array:
    """Sum of e[s] e[t]^T (n, p) -> (p, p) over all |s - t| <= lags, weighted by 1 - |s - t| / (lags + 1).

    As a weighted sum of the periodogram: n log n operations where the lags one by one take n squared.
    """
    length = next_fast_len(len(e) + lags, real=True)
    spectrum = rfft(e, length, axis=0)
    weights = np.zeros(length)
    weights[: lags + 1] = 1.0 - np.arange(lags + 1) / (lags + 1)
    weights[-lags:] = weights[lags:0:-1]
    gain = rfft(weights).real * 2.0 / length
    gain[0] /= 2.0
    if length % 2 == 0:
        gain[-1] /= 2.0
    weighted: Array = spectrum.real.T @ (gain[:, None] * spectrum.real)
    weighted += spectrum.imag.T @ (gain[:, None] * spectrum.imag)
    return weighted


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
