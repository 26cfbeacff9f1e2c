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


@dataclass(frozen=True, slots=True)
class Extreme:
    """The statistic of one channel, over several recordings, and where it occurs."""

    channel: str
    value: float
    recording: str
    time_s: float | None  # None for an rms


def extremes(
    signals: Sequence[tuple[str, Signal]], channels: Sequence[str], statistic: Literal["peak", "rms"]
) -> tuple[Extreme, ...]:
    """Return the largest `statistic` of each channel over (recording, signal) pairs, valid samples only."""
    found = []
    for channel in channels:
        candidates = [
            _extreme(name, signal, channel, statistic)
            for name, signal in signals
            if channel in signal.channels and signal.valid.any()
        ]
        if candidates:
            found.append(max(candidates, key=lambda extreme: extreme.value))
    return tuple(found)


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


def judge(value: float, sigma: float, limit: float, below: float = COVERAGE) -> Judgement:
    """Compare a value with its limit: decided only where the expanded uncertainty leaves no doubt.

    Simple acceptance with guard bands on both sides (JCGM 106:2012, 8.3): "pass" if value + 2 sigma <= limit,
    "fail" if value - `below` sigma > limit, else "undecided". Noise raises a peak and never lowers it: the true one
    is below the measured one by up to `peak_coverage` sigmas.
    """
    if value + COVERAGE * sigma <= limit:
        return "pass"
    if value - below * sigma > limit:
        return "fail"
    return "undecided"
