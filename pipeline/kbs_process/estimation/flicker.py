"""White and 1/f noise: fitted to what a model leaves, and carried to the scores of its parameters.

What varies as slowly as the model does, the parameters take up: residuals hold little of it, and a long-run covariance
taken from them finds little. That part is extrapolated here, by the law that a sensor's zero follows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kbs_process.signals.records import Array

_KNEES = np.geomspace(1e-4, 10.0, 101)  # Hz, candidates, a factor 1.12 apart
_TAKEN_UP = 4  # slowest harmonics of a record, which the parameters have taken up


@dataclass(frozen=True, slots=True)
class Flicker:
    """Power S(f) = white + pink / f: variance of a sample, were the noise white at its level there."""

    white: float
    pink: float  # Hz

    def at(self, f: Array) -> Array:
        """S at frequencies f (k,) in Hz, > 0."""
        power: Array = self.white + self.pink / f
        return power


def fit_flicker(residual: Array, dt: float, highest: float) -> Flicker:
    """White and 1/f power of residual (n,) between the fifth harmonic of its length and `highest` Hz.

    Whittle's likelihood (Ark. Mat. 2:423, 1953): periodogram ordinates are independent and exponential about S. The
    power is its mean over the frequency (flat in its logarithm) where both kinds of noise are equal, since the
    likeliest alone would too often find no 1/f noise where a short record shows little.
    """
    n = len(residual)
    f = np.fft.rfftfreq(n, dt)
    inside = (np.arange(len(f)) > _TAKEN_UP) & (f <= highest)
    if inside.sum() < 2:
        return Flicker(float(np.mean(residual**2)), 0.0)
    power = np.abs(np.fft.rfft(residual)[inside]) ** 2 / n
    shapes = 1.0 + _KNEES[:, None] / f[inside]
    levels = np.mean(power / shapes, axis=1)
    misfit = inside.sum() * np.log(np.maximum(levels, 1e-300)) + np.sum(np.log(shapes), axis=1)
    weight = np.exp(misfit.min() - misfit)
    weight /= weight.sum()
    return Flicker(float(weight @ levels), float(weight @ (levels * _KNEES)))


def flicker_scores(residual: Array, J: Array, dt: float, highest: float) -> Array:
    """Covariance (p, p) of the scores J^T e of a record, e white and 1/f noise of each channel alone.

    `residual` (n, c) and J (n, c, p) are sampled every `dt` s. The zero frequency counts as half of the record's
    lowest.
    """
    n, total = len(residual), np.zeros((J.shape[2], J.shape[2]))
    f = np.maximum(np.fft.rfftfreq(n, dt), 0.5 / (n * dt))
    twice = np.full(len(f), 2.0)  # positive and negative frequencies, but for the zero and the highest
    twice[0] = 1.0
    if n % 2 == 0:
        twice[-1] = 1.0
    for channel, left in enumerate(residual.T):
        power = fit_flicker(left, dt, highest).at(f)
        G = np.fft.rfft(J[:, channel], axis=0) * np.sqrt(twice * power / n)[:, None]
        total += G.real.T @ G.real + G.imag.T @ G.imag
    return total
