"""Statistics of pointing errors from time histories, each with the uncertainty that its correlated samples leave.

An error is a true (or measured) angle less the desired one at the same instant. Statistics are those of the
requirement that they are held against:

- bias: the mean;
- random: twice the standard deviation about the bias;
- percentile: the value that 95 % of |error| stay below, bias included;
- orbit: half the range of the slow part, a moving mean, within any one orbit (peak).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d, uniform_filter1d

from kbs_process.errors import RecordingError
from kbs_process.estimation.longrun import longrun_covariance
from kbs_process.signals.records import Array, Mask, Signal

SHARE = 0.95
MIN_SAMPLES = 100
_BLOCKS = 400  # of samples, between whose means little correlation is left


@dataclass(frozen=True, slots=True)
class PointingStatistics:
    """Pointing error of one axis, rad; each sigma is one standard deviation of the estimate beside it."""

    axis: str
    samples: int
    bias: float
    bias_sigma: float
    random: float  # 2 sigma
    random_sigma: float
    percentile: float  # of |error|
    percentile_sigma: float
    orbit: float  # peak
    orbit_sigma: float  # of the moving mean, from the random error: as much of `orbit` may be noise
    greatest: float  # |error|


def error(actual: Signal, t: Array, desired: Array) -> Signal:
    """Return actual angles less the desired ones (m, c), rad, given at times t (m,), s, linear in between.

    Columns of `desired` are the channels of `actual`. Where a step of commands bends, the linear course errs by up to
    an eighth of acceleration x (time between commands)^2: 2e-6 deg at 0.015 deg/s^2 and 0.1 s. Samples outside the
    commands are flagged.
    """
    course = np.stack([np.interp(actual.t, t, column) for column in desired.T], axis=1)
    covered = (actual.t >= t[0]) & (actual.t <= t[-1])
    return actual.derive(
        actual.values - course, "less the desired angle at the same instant", valid=actual.valid & covered
    )


def line_of_sight(error: Signal, elevation: Array) -> Signal:
    """Return cross-elevation and elevation error of the boresight, rad, and their resultant.

    `error` has azimuth and elevation (n, 2); `elevation` (n,) is where the antenna points. Azimuth turns the
    boresight by cos(el) of its own angle; first order, valid to error^2 / 2: 1e-7 of 1 mrad.
    """
    cross, along = error.values[:, 0] * np.cos(elevation), error.values[:, 1]
    return Signal(
        t0=error.t0,
        dt=error.dt,
        values=np.stack([cross, along, np.hypot(cross, along)], axis=1),
        channels=("cross-elevation", "elevation", "line of sight"),
        units=("rad",) * 3,
        frame="boresight",
        valid=error.valid,
        history=(*error.history, "turned into the boresight's frame"),
    )


def slow_part(x: Array, window: int) -> Array:
    """Moving mean of x (n,) over `window` samples; shorter at the ends, where samples are missing."""
    weight = uniform_filter1d(np.ones_like(x), window, mode="constant")
    mean: Array = uniform_filter1d(x, window, mode="constant") / weight
    return mean


def orbit_variation(x: Array, dt: float, smoothing: float, period: float) -> float:
    """Greatest departure of the slow part of x (n,) from the middle of its range, within any stretch of `period` s.

    Half of the greatest range within a stretch, so that it does not depend on where the orbit is cut.
    """
    slow = slow_part(x, max(1, round(smoothing / dt)))
    length = min(len(slow), max(1, round(period / dt)))
    ranges = maximum_filter1d(slow, length) - minimum_filter1d(slow, length)
    return 0.5 * float(np.max(ranges))


def statistics(
    error: Signal, period: float, smoothing: float, within: Mask | None = None
) -> tuple[PointingStatistics, ...]:
    """Return the statistics of every channel over its valid samples, those `within` alone where given.

    `period` is the orbit's, s; `smoothing` the averaging time of the slow part, s.
    Raises RecordingError where fewer than `MIN_SAMPLES` are left.
    """
    valid = error.valid if within is None else error.valid & within
    if np.count_nonzero(valid) < MIN_SAMPLES:
        raise RecordingError(
            f"{np.count_nonzero(valid)} samples of the pointing error are no statistics",
            remedy="choose a longer stretch",
        )
    return tuple(_one(channel, error.column(channel)[valid], error.dt, period, smoothing) for channel in error.channels)


def _one(axis: str, e: Array, dt: float, period: float, smoothing: float) -> PointingStatistics:
    bias, deviation = float(np.mean(e)), float(np.std(e, ddof=1))
    magnitude = np.abs(e)
    percentile = float(np.quantile(magnitude, SHARE))
    # Influence of every sample on mean, standard deviation and quantile: their sum's variance is the estimate's.
    scores = np.stack(
        [
            e - bias,
            ((e - bias) ** 2 - np.mean((e - bias) ** 2)) / (2.0 * deviation) if deviation > 0.0 else 0.0 * e,
            (SHARE - (magnitude <= percentile)) / _density(magnitude),
        ],
        axis=1,
    )
    sigma = uncertainty(scores)
    return PointingStatistics(
        axis=axis,
        samples=len(e),
        bias=bias,
        bias_sigma=float(sigma[0]),
        random=2.0 * deviation,
        random_sigma=2.0 * float(sigma[1]),
        percentile=percentile,
        percentile_sigma=float(sigma[2]),
        orbit=orbit_variation(e, dt, smoothing, period),
        orbit_sigma=float(sigma[0]) * max(1.0, len(e) * dt / smoothing) ** 0.5,
        greatest=float(magnitude.max()),
    )


def uncertainty(scores: Array) -> Array:
    """Standard deviation (p,) of the means of correlated scores (n, p) with mean zero.

    Blocks of samples are averaged first, so that what is left of the correlation spans few of them, as the
    long-run variance needs. Valid where the memory is well below 1/20 of the record.
    """
    size = max(1, len(scores) // _BLOCKS)
    blocks = len(scores) // size
    means = scores[: blocks * size].reshape(blocks, size, -1).mean(axis=1)
    sigma: Array = np.stack([np.sqrt(longrun_covariance(column[:, None])[0, 0]) / blocks for column in means.T])
    return sigma


def _density(magnitude: Array) -> float:
    """Density of |error| at its 95 % quantile, 1/rad, from the quantiles 2.5 % to either side."""
    low, high = np.quantile(magnitude, [SHARE - 0.025, SHARE + 0.025])
    return 0.05 / max(float(high - low), np.finfo(np.float64).tiny)
