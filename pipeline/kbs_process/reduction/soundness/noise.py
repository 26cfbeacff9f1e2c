"""Noise of the recordings against the noise that is stated."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

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
        for off, read, why in (
            (factor * less < noise, less, "averaged or filtered before it was stored, or in another scale"),
            (more > factor * noise, more, "disturbed, or in another scale"),
            (
                (turns > factor * noise) & ~(more > factor * noise),
                turns,
                "up and down from sample to sample, by two sources in turn, or hum",
            ),
        ):
            told = [
                f"{own[k]} has {read[k]:.2g} {rig.loads.units[index[k]]} rms, not {noise[k]:.2g} +- {sigma[k]:.2g}"
                for k in np.flatnonzero(off)
            ]
            if told:
                yield Doubt(f"the noise is not as stated in {one.entry.name}: {', '.join(told)}: {why}")


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
