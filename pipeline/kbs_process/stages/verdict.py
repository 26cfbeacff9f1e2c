"""The verdict against a requirement: met, not met, or undecided within the uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from kbs_process.signals.records import Signal

# Coverage factor of the expanded uncertainty (JCGM 100:2008, 6.2): about 95 %.
COVERAGE = 2.0
ONE_SIDED = 0.0228  # probability beyond +2 sigma of a normal error

Judgement = Literal["pass", "fail", "undecided"]
SEVERITY: dict[Judgement, int] = {"pass": 0, "undecided": 1, "fail": 2}


@dataclass(frozen=True, slots=True)
class Extreme:
    """The statistic of one channel in one recording, and when it occurs."""

    channel: str
    value: float
    recording: str
    time_s: float | None  # None for an rms


def extremes(
    signals: Sequence[tuple[str, Signal]], channels: Sequence[str], statistic: Literal["peak", "rms"]
) -> tuple[Extreme, ...]:
    """Return the `statistic` of each channel in each of (recording, signal) pairs, valid samples only."""
    return tuple(
        _extreme(name, signal, channel, statistic)
        for channel in channels
        for name, signal in signals
        if channel in signal.channels and signal.valid.any()
    )


def _extreme(name: str, signal: Signal, channel: str, statistic: Literal["peak", "rms"]) -> Extreme:
    x = np.where(signal.valid, signal.column(channel), 0.0)
    if statistic == "rms":
        rms = float(np.sqrt(np.sum(x**2) / np.count_nonzero(signal.valid)))
        return Extreme(channel, rms, name, None)
    at = int(np.argmax(np.abs(x)))
    return Extreme(channel, float(abs(x[at])), name, float(signal.t[at]))


def peak_coverage(crossings: float) -> float:
    """Return how many sigmas below a measured peak the true one may lie: what noise alone may make of a peak.

    The peak of signal and noise is at most the sum of their peaks. Gaussian noise that crosses zero upwards `crossings`
    times leaves +- c sigma 2 crossings exp(-c^2 / 2) times on average (Rice, Bell Syst. Tech. J. 24, 1945, 3.3); c is
    such that it does not with the probability with which a normal error stays below 2 sigma. High levels are left
    independently of each other. Crossings need not be well known: half as many again raise c by 0.1.
    """
    return float(np.sqrt(max(2.0 * np.log(2.0 * max(crossings, 1.0) / ONE_SIDED), COVERAGE**2)))


def interval(value: float, sigma: float, below: float = COVERAGE) -> tuple[float, float]:
    """Return between which figures the true peak or rms lies, at 95 %: value - `below` sigma, value + 2 sigma.

    Noise raises a peak and never lowers it: the true one is below the measured one by up to `peak_coverage` sigmas.
    Neither statistic is negative.
    """
    return max(value - below * sigma, 0.0), value + COVERAGE * sigma


def judge(value: float, sigma: float, limit: float, below: float = COVERAGE) -> Judgement:
    """Compare a value with its limit: decided only where the expanded uncertainty leaves no doubt.

    Simple acceptance with guard bands on both sides (JCGM 106:2012, 8.3): "pass" if all of the `interval` is within
    the limit, "fail" if all of it is beyond, else "undecided".
    """
    low, high = interval(value, sigma, below)
    if high <= limit:
        return "pass"
    return "fail" if low > limit else "undecided"
