"""Laws that act only while an earlier one does: recordings do not tell them from what its formula lacks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from kbs_process.diagnosis.experiments.hypothesis import Simulate
from kbs_process.diagnosis.experiments.thresholds import MOMENTS, MOSTLY, WHILE
from kbs_process.diagnosis.nominal.joint import Own, Standing, bare
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.signals.records import Array, Mask


def only_while(
    earlier: Sequence[tuple[str, Own]], before: Standing, after: Known, simulate: Simulate
) -> tuple[str, ...]:
    """Return why what `after` gains over `before` is no law of its own; nothing, if it is.

    `earlier` are the laws that `before` has, by name, with their numbers. One that acts most of the time says nothing.
    """
    reasons = []
    for name, own in earlier:
        if not own.names:
            continue
        acts, share = _acting(before.known, bare(before, own, simulate).known)
        if share > MOMENTS:
            continue
        there = _gained(before.known, after, acts)
        if there > WHILE:
            reasons.append(
                f"gains {100.0 * there:.0f} % of what it gains while {name} acts, {100.0 * share:.0f} % of the time: "
                "its formula may be as far from nature's"
            )
    return tuple(reasons)


def _acting(known: Known, out: Known) -> tuple[list[Mask], float]:
    """Samples of each fit trial in which a law, which `out` is without, does most of what it does; their share."""
    power = [
        np.sum((_in_time(known, out.residual[k], k) - _in_time(known, known.residual[k], k)) ** 2, axis=1)
        for k in known.experiment.fit
    ]
    return most_of(power)


def most_of(power: Sequence[Array]) -> tuple[list[Mask], float]:
    """The fewest samples of series (n,) that hold `MOSTLY` of their power, as masks, and their share of all."""
    every = np.concatenate(power)
    falling = np.sort(every)[::-1]
    count = 1 + int(np.searchsorted(np.cumsum(falling), MOSTLY * falling.sum()))
    least = falling[min(count, len(falling)) - 1]
    return [series >= least for series in power], min(count, len(falling)) / len(falling)


def _gained(before: Known, after: Known, acts: Sequence[NDArray[np.bool_]]) -> float:
    """Share of the gain in whitened squares, in time, that falls on some samples of the fit trials."""
    there = everywhere = 0.0
    for k, mask in zip(before.experiment.fit, acts, strict=True):
        gain = np.sum(_in_time(before, before.residual[k], k) ** 2 - _in_time(after, after.residual[k], k) ** 2, axis=1)
        there += float(gain[mask].sum())
        everywhere += float(gain.sum())
    return there / everywhere if everywhere > 0.0 else 0.0


def _in_time(known: Known, z: Array, k: int) -> Array:
    return known.metric[k].in_time(z, len(known.experiment.trials[k].valid))
