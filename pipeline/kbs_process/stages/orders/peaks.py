r"""Which peaks of an order spectrum are no chance, by the noise's own spectrum.

Equation: the floor F(k) of a mean power P(k) is the straight line through ln P over ln k of the lines about k, those
    that stand out left aside, plus what the mean logarithm of M exponentials lacks, ln M - psi(M). M is the square of
    the sum over windows of a power by the sum of its squares: what one window has alone is no mean. A peak counts where
    P / F > q, the quantile of an F distribution with 2 M and 2 / v degrees of freedom, v the variance of ln F. Its
    probability is ALPHA over all lines and channels of a recording. Amplitude $A = \sqrt{P - F}$, standard deviation
    $\sqrt{F (1 + F / 2 A^2) / 2 M}$.
    A load that is stationary in time, with the spectrum T(f) that was seen, has the mean of T at k, weighted with the
    spectrum R(f) that an order k of amplitude 1 has in time. Of a tone that is P, or 0.72 P where R is a line itself;
    of an order it is $c = \sum R^2 / \sum R$ of P. What has more than the middle of c and 0.72 is a tone or a
    resonance, and no peak. With c above 0.6 the rate varies too little to say so: the peak is `fixed`.
Units: N m.
Validity: noise whose power over order bends little within 8 lines, and within 16 at its ends.
Source: P. D. Welch, The use of fast Fourier transform for the estimation of power spectra, IEEE Trans. Audio and
    Electroacoustics 15 (1967) 70; floor: ordinary least squares.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import digamma, polygamma
from scipy.stats import f as fisher

from kbs_process.signals.records import Array, Mask
from kbs_process.stages.orders.tracking import LEAST, OVER, Average, Track, in_frequency

ALPHA = 0.01  # probability that chance makes any peak of a recording's spectra of one joint
_ABOUT = 8 * OVER  # orders to either side that a floor rests on
_AT_ENDS = 2 * _ABOUT  # that it rests on at least, where it has them on one side alone
_PASSES = 3  # in which peaks are left out of their own floor
_CORRELATED = 1.5 * OVER  # computed orders to one that is independent
_LOBES = 2.0  # lines about a peak that are its own
_LINE = 0.72  # what a line behind a Hann window has of its own power, weighted with itself
_STEADY = 0.6  # share of an order's power that would be seen of a fixed frequency: the rate varies too little
_MOST = 16  # peaks of a channel


@dataclass(frozen=True, slots=True, eq=False)
class Floor:
    """Noise of one channel over order, and the power above which a peak is none of it."""

    noise: Array  # (m,)
    threshold: Array  # (m,)


@dataclass(frozen=True, slots=True)
class Peak:
    """A peak: amplitude, its standard deviation, and whether a tone of fixed frequency explains it as well."""

    order: float
    amplitude: float
    sigma: float
    fixed: bool


def floor_of(spectrum: Average, column: int, channels: int) -> Floor:
    """Return the floor of one channel's powers, where the false alarms of so many channels share ALPHA."""
    power, m = spectrum.power[:, column], spectrum.averages[:, column]
    usable = spectrum.order * spectrum.length >= LEAST
    x = np.log(np.where(usable, spectrum.order, 1.0))
    y = np.log(np.maximum(power, 1e-300)) + np.log(m) - digamma(m)
    chance = ALPHA / max(channels * np.count_nonzero(usable) / OVER * 2.0, 1.0)
    counts, noise, threshold = usable, power, power
    for _ in range(_PASSES):
        noise, leverage = _line(x, y, counts)
        variance = polygamma(1, m) * leverage * _CORRELATED
        threshold = noise * fisher.isf(chance, 2.0 * m, 2.0 / variance)
        out = np.convolve(power > threshold, np.ones(2 * int(_LOBES * OVER) + 1), "same") > 0.0
        counts = usable & ~out
    return Floor(noise, np.where(usable, threshold, np.inf))


def _line(x: Array, y: Array, counts: Mask) -> tuple[Array, Array]:
    """Return exp of the straight line through the points about each, and its variance over that of a point."""
    w = counts.astype(np.float64)

    def about(values: Array) -> Array:
        sums = np.concatenate([[0.0], np.cumsum(values)])
        found: Array = sums[end] - sums[begin]
        return found

    at, first = np.arange(len(x)), int(np.argmax(counts))
    begin = np.maximum(np.minimum(at - _ABOUT, len(x) - _AT_ENDS), 0)
    end = np.minimum(np.maximum(at + _ABOUT + 1, first + _AT_ENDS), len(x))

    n = np.maximum(about(w), 1.0)
    mean_x, mean_y = about(w * x) / n, about(w * y) / n
    spread = np.maximum(about(w * x * x) / n - mean_x**2, 1e-12)
    slope = (about(w * x * y) / n - mean_x * mean_y) / spread
    away = x - mean_x
    return np.exp(mean_y + slope * away), (1.0 + away**2 / spread) / n


def peaks(track: Track, spectrum: Average, column: int, floor: Floor) -> list[Peak]:
    """Return the peaks of one channel, the greatest first; what is a side lobe of another, or a tone, is none."""
    power, tones = spectrum.power[:, column], spectrum.tones[:, column]
    found: list[Peak] = []
    for top in _tops(power, floor)[:_MOST]:
        order, height = _top(spectrum.order, power, top)
        seen = in_frequency(track, spectrum.length, order)
        steady = float(np.sum(seen**2) / np.sum(seen))
        if steady < _STEADY and np.sum(seen * tones) > 0.5 * (steady + _LINE) * np.sum(seen) * height:
            continue
        noise = float(floor.noise[top])
        square = max(height - noise, 0.5 * noise)
        sigma = np.sqrt(0.5 * noise * (1.0 + 0.5 * noise / square) / spectrum.averages[top, column])
        found.append(Peak(order, float(np.sqrt(square)), float(sigma), steady >= _STEADY))
    return found


def _tops(power: Array, floor: Floor) -> list[int]:
    """Places of the peaks above the threshold, the greatest first, without the side lobes of greater ones."""
    inner = power[1:-1]
    tops = np.flatnonzero((inner >= power[:-2]) & (inner > power[2:]) & (inner > floor.threshold[1:-1])) + 1
    leaked, found = floor.threshold.copy(), []
    for top in tops[np.argsort(-power[tops])]:
        if power[top] > leaked[top]:
            away = np.abs(np.arange(len(power)) - top) / OVER
            lobes = 2.0 / (np.pi * np.maximum(away * (away**2 - 1.0), 1.0 / np.pi))
            leaked += power[top] * np.where(away < _LOBES, np.inf, lobes**2)
            found.append(int(top))
    return found


def _top(order: Array, power: Array, at: int) -> tuple[float, float]:
    """Place and height of the parabola through the logarithms of a top and its neighbours."""
    a, b, c = np.log(np.maximum(power[at - 1 : at + 2], 1e-300))
    shift = 0.5 * (a - c) / (a - 2.0 * b + c) if a - 2.0 * b + c < 0.0 else 0.0
    return float(order[at] + shift * (order[1] - order[0])), float(np.exp(b - 0.25 * (a - c) * shift))
