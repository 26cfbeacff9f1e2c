r"""How well repeats of a trajectory agree: signal, noise and their ratio in a band.

Repeats y_r (r = 1 .. R) are a common signal plus noise of their own, y_r = s + e_r. With the mean over repeats m,
    noise^2 = sum_r |y_r - m|^2 / (n (R - 1)),    signal^2 = |m|^2 / n - noise^2 / R
unbiased both; the second may come out negative where there is no signal, and is then 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.stats import chi2

from kbs_process.errors import RecordingError
from kbs_process.signals.records import Array, Mask, Signal

CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True, eq=False)
class Repeatability:
    """Per channel, arrays (c,), in the signals' unit."""

    channels: tuple[str, ...]
    units: tuple[str, ...]
    signal: Array  # rms of what is common
    noise: Array  # rms of what is not
    noise_low: Array  # 95 % confidence interval of the noise
    noise_high: Array
    degrees: Array  # effective degrees of freedom of the noise
    ratio: Array  # signal / noise; infinite without noise
    repeats: int
    samples: int  # of each repeat, valid in all of them


def on_common_axis(runs: Sequence[Signal], starts: Sequence[float]) -> list[Signal]:
    """Shift repeats so that each one's `starts` (s) falls on the first one's, and cut them to what all have.

    Between samples by cubic splines: error below 6e-4 of a component at a tenth of the sampling rate, which is
    the upper end of the bands (2 Hz at 20 Hz).
    """
    reference = runs[0]
    lead = [start - starts[0] for start in starts]
    first = max(run.t0 - shift for run, shift in zip(runs, lead, strict=True))
    last = min(run.t[-1] - shift for run, shift in zip(runs, lead, strict=True))
    low = int(np.ceil((first - reference.t0) / reference.dt - 1e-9))
    high = int(np.floor((last - reference.t0) / reference.dt + 1e-9))
    t = reference.t0 + reference.dt * np.arange(low, high + 1, dtype=np.float64)
    return [_shifted(run, t, shift) for run, shift in zip(runs, lead, strict=True)]


def _shifted(run: Signal, t: Array, shift: float) -> Signal:
    at = (t + shift - run.t0) / run.dt
    below = np.clip(np.floor(at + 1e-9).astype(np.int64), 0, len(run) - 1)
    above = np.clip(np.ceil(at - 1e-9).astype(np.int64), 0, len(run) - 1)
    values = run.values[below]
    if np.any(below != above):
        values = CubicSpline(run.t, run.values)(t + shift)
    return replace(
        run,
        t0=float(t[0]) if len(t) else run.t0,
        values=values,
        valid=run.valid[below] & run.valid[above],
        history=(*run.history, f"shifted by {-shift:.6g} s"),
    )


def in_common(runs: Sequence[Signal]) -> int:
    """Return how many samples are valid in all repeats."""
    return int(np.count_nonzero(_valid(runs)))


def _valid(runs: Sequence[Signal]) -> Mask:
    """(n,) where all repeats are valid, over their common length."""
    n = min(len(run) for run in runs)
    return np.asarray(np.logical_and.reduce([run.valid[:n] for run in runs]), dtype=np.bool_)


def fit(runs: Sequence[Signal]) -> Repeatability:
    """Compare repeats on the same axis, over their common length and samples valid in all.

    The interval is chi-squared with the effective degrees of freedom (R - 1) n / (sum_k rho_k^2), rho the noise's
    autocorrelation over lags k of both signs: neighbours of a band-limited signal are not independent
    (Bartlett's formula for the variance of a variance).

    Raises RecordingError for fewer than two repeats, other axes or channels, or no common valid sample.
    """
    _same_axis(runs)
    n = min(len(run) for run in runs)
    valid = _valid(runs)
    samples = int(np.count_nonzero(valid))
    if samples < 2:
        raise RecordingError("the repeats have no valid sample in common", remedy="check gaps and the band's edges")
    y = np.stack([run.values[:n] for run in runs])
    mean = y.mean(axis=0)
    rest = np.where(valid[:, None], y - mean, 0.0)
    repeats = len(runs)
    variance = np.sum(rest**2, axis=(0, 1)) / (samples * (repeats - 1))
    common = np.sum(mean[valid] ** 2, axis=0) / samples - variance / repeats
    degrees = np.array([_degrees(rest[:, :, c], samples) for c in range(y.shape[2])])
    signal, noise = np.sqrt(np.maximum(common, 0.0)), np.sqrt(variance)
    tail = 0.5 * (1.0 - CONFIDENCE)
    return Repeatability(
        channels=runs[0].channels,
        units=runs[0].units,
        signal=signal,
        noise=noise,
        noise_low=noise * np.sqrt(degrees / chi2.ppf(1.0 - tail, degrees)),
        noise_high=noise * np.sqrt(degrees / chi2.ppf(tail, degrees)),
        degrees=degrees,
        ratio=np.divide(signal, noise, out=np.full_like(signal, np.inf), where=noise > 0.0),
        repeats=repeats,
        samples=samples,
    )


def _same_axis(runs: Sequence[Signal]) -> None:
    if len(runs) < 2:
        raise RecordingError("repeatability needs two repeats of a trajectory or more", remedy="record it again")
    first = runs[0]
    for run in runs[1:]:
        if (run.t0, run.dt, run.channels, run.frame) != (first.t0, first.dt, first.channels, first.frame):
            raise RecordingError(
                "the repeats differ in time axis, channels or frame", remedy="bring them to one before comparing"
            )


def _degrees(rest: Array, samples: int) -> float:
    """Effective degrees of freedom of the sum of squares of rest (R, n)."""
    repeats, n = rest.shape
    size = 1 << (2 * n - 1).bit_length()
    power = np.sum(np.abs(np.fft.rfft(rest, size, axis=1)) ** 2, axis=0)
    covariance = np.fft.irfft(power, size)[:n]
    if covariance[0] == 0.0:
        return float((repeats - 1) * samples)
    # Longer lags have too few products to be told from the noise of the estimate.
    lags = max(n // 4, 1)
    rho = covariance[:lags] / covariance[0]
    correlated = 1.0 + 2.0 * float(np.sum(rho[1:] ** 2))
    return float(max((repeats - 1) * samples / correlated, 1.0))
