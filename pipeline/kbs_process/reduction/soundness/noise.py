"""Noise of the recordings against the noise that is stated."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import comb

import numpy as np
from scipy.signal import periodogram
from scipy.stats import chi2

from kbs_process.campaign.config import Requirement
from kbs_process.reduction import measurable
from kbs_process.reduction.held import noisy
from kbs_process.reduction.preparing import Prepared
from kbs_process.results.judged import Doubt
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array
from kbs_process.stages.align.readings import white
from kbs_process.stages.align.spectrum import OCTAVES, quietest
from kbs_process.stages.conventions import BEYOND

SLOW = 0.5  # share of its power that slow white noise may lose: rounding and bridged gaps take less
_RARE = 1e-6  # probability that chance takes as much
_DETRENDED = 2  # lines of a periodogram that a straight line takes
UNLIKE = 3.0  # times less noise than is stated, or more, however well it is known


def unlike_stated(requirement: Requirement, rig: Rig, recordings: Sequence[Prepared]) -> Iterator[Doubt]:
    """Channels with far less white noise than is stated, and those with far more, unless rounding hides it (`noisy`).

    What averages or filters readings takes noise off as it takes off peaks: next to the band, in the octaves above it.
    Noise is more where it is so up to half the sampling rate, and from sample to sample. Two sources that write one
    stream by turns differ from sample to sample, and what is read is the mean of both.
    """
    own, stated, amplifier = rig.transducer.channels, noisy(rig), rig.transducer.amplifier
    judged = measurable.needed_channels(requirement, rig)
    near = min(2.0**OCTAVES * requirement.band[1], np.inf if amplifier is None else float(amplifier.corner))
    index = rig.loads.index(own)
    noise = np.array([stated.get(channel, np.nan) if channel in judged else np.nan for channel in own])
    sigma = rig.transducer.noise.sigma[index]
    factor = np.maximum(UNLIKE, np.exp(np.minimum(BEYOND * sigma / noise, 100.0)))  # beyond, nothing is known
    for one in recordings:
        less, more = measured_noise(rig, one, near)
        turns = np.full(len(own), np.nan) if one.run.spectrum is None else one.run.spectrum.alternating
        slow = less * np.sqrt(slow_share(one, less, requirement.band))
        for off, read, why in (
            (factor * less < noise, less, "averaged or filtered before it was stored, or in another scale"),
            ((slow < less) & np.isfinite(noise), slow, "in slow readings: AC-coupled, or behind a high-pass"),
            (more > factor * noise, more, "disturbed, or in another scale"),
            (
                (turns > factor * noise) & ~(more > factor * noise),
                turns,
                "up and down from sample to sample, by two sources in turn, or hum",
            ),
        ):
            told = [
                f"{own[k]} has {read[k]:.2g} {rig.loads.units[index[k]]} rms, not {noise[k]:.2g}"
                + (f" +- {sigma[k]:.2g}" if sigma[k] else "")
                for k in np.flatnonzero(off)
            ]
            if told:
                yield Doubt(f"the noise is not as stated in {one.entry.name}: {', '.join(told)}: {why}")


def slow_share(one: Prepared, level: Array, band: tuple[float, float]) -> Array:
    """Least share (c,) of a white noise's power, of `level` (c,) rms a sample, in readings from a band's low edge on.

    It is 1 where that may be chance, in up to three channels together, or where there is no noise. Signals only add to
    noise: what takes slow noise off takes slow loads off. The window keeps what a recording begins or ends with out of
    quiet lines; of two of its lines one is new.
    """
    if one.run.spectrum is None:
        return np.ones(len(level))
    level = np.where(level > 0.0, level, np.nan)
    f, power = periodogram(one.raw.values, 1.0 / one.raw.dt, "hann", detrend="linear", axis=0)  # type: ignore[call-overload]
    share, low, edge = np.ones(len(level)), max(band[0], f[min(_DETRENDED, len(f) - 1)]), band[1]
    while edge > 2.0 * low:
        ratio = power[(f >= low) & (f < edge)] * 0.5 * one.run.rates["wrench"] / level**2
        mean = ratio.mean(axis=0)
        chance = np.where(mean < SLOW, chi2.cdf(mean * len(ratio), len(ratio)), 1.0)
        order = np.argsort(chance)
        for count in range(1, min(3, len(order)) + 1):
            if comb(len(order), count) * chance[order[count - 1]] ** count < _RARE:
                share[order[:count]] = np.minimum(share, mean)[order[:count]]
        edge /= 2.0
    return share


def measured_noise(rig: Rig, one: Prepared, near: float = np.inf) -> tuple[Array, Array]:
    """White noise (c,) of each recorded channel, rms: in the octaves below `near`, Hz; in all, and between samples.

    NaN where nothing tells.
    """
    index = rig.loads.index(rig.transducer.channels)
    if (spectrum := one.run.spectrum) is None or "wrench" not in one.readings:
        return np.full(len(index), np.nan), np.full(len(index), np.nan)
    reads = np.eye(len(index)) + rig.transducer.cross_coupling.value[np.ix_(index, index)]
    raw, rate = replace(spectrum, S=reads @ spectrum.S @ reads.T), one.run.rates["wrench"]
    first = white(np.concatenate(one.readings["wrench"].head))
    return quietest(raw, rate, near), np.minimum(quietest(raw, rate, np.inf), first)
