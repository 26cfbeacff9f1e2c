"""What believed laws leave of the recordings, and whether one more takes enough of it to be one."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from kbs_process.diagnosis.experiments.floor import Floor
from kbs_process.diagnosis.experiments.hypothesis import Simulate
from kbs_process.diagnosis.experiments.thresholds import (
    EVERYWHERE,
    LEAD,
    LEAST_RHO,
    MOMENTS,
    MOSTLY,
    TAKEN,
    TAKEN_UNUSED,
    TOLERATED,
    UNFORESEEN,
    WHILE,
)
from kbs_process.diagnosis.nominal.detection import Detection
from kbs_process.diagnosis.nominal.joint import Own, Standing, bare
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.diagnosis.nominal.settling import detected, searched
from kbs_process.diagnosis.proposing.view import View
from kbs_process.signals.records import Array, Mask


def taken(there: Detection, here: Detection) -> float:
    """Share that a law takes of what exceeds the floor `there`, of which it leaves what is `here`; all of nothing."""
    return 1.0 - max(here.ratio - 1.0, 0.0) / (there.ratio - 1.0) if there.left else 1.0


def too_little(
    before: Standing, after: Standing, floor: Floor, *, sigmas: float = 0.0, more: bool = False
) -> tuple[str, ...]:
    """Return why what a law takes does not tell it from something else; nothing, if it does.

    What two minima of phases and tooth contact leave differs, too, and a law with numbers enough follows that. It shows
    less than that in every trajectory, unless parts of the recordings all show it, by `sigmas`. What is `more` of a law
    that was found need take no share of all that is left.
    """
    experiment = before.known.experiment
    there, here = (detected(one, floor, experiment.fit) for one in (before, after))
    reasons = []
    share = taken(there, here)
    if not (more or share >= TAKEN):
        reasons.append(f"takes {100.0 * share:.0f} % of what exceeds the repeatability: it follows another cause")
    left = here.ratios
    most = max(ratio - left[trajectory] for trajectory, ratio in there.ratios.items())
    # What known numbers had taken up shows where they are.
    relieved = before.known.strained and not after.known.strained
    if searched(experiment) and not (most >= TOLERATED or sigmas >= EVERYWHERE or relieved):
        reasons.append(f"takes {100.0 * most:.1f} % of the repeatability's power: {_DIFFER}")
    elif not there.left and not before.known.cost - after.known.cost >= LEAST_RHO**2:
        reasons.append("nominal parameters alone are as likely")
    return tuple(reasons)


def missed(before: Known, after: Known, blind: Collection[int] = ()) -> tuple[str, ...]:
    """Return why recordings that were not used speak against a law, all others being in the plant; nothing, if none do.

    Of every held-out recording that is still missed, by more than nulls are, it has to take some, too. Another law may
    be what that recording shows, so this is asked when no more are found; those in which it does nothing are `blind`.
    """
    reasons = []
    for k in (one for one in after.experiment.held_out if one not in blind):
        left, gained = after.chi2[k] - after.rows[k], before.chi2[k] - after.chi2[k]
        if left > UNFORESEEN * after.rows[k] and not gained >= TAKEN_UNUSED * (left + gained):
            share = 100.0 * gained / (left + gained)
            reasons.append(f"takes {share:.0f} % of the excess of {after.experiment.trials[k].name}")
    return tuple(reasons)


def promises_little(view: View, there: Detection) -> str:
    """Return why no suspect of a view is worth a simulation, where nothing is left and none does much; else "".

    All that a suspect gains may be along one trajectory, of which repeats and encoders at rest make less rows.
    """
    if there.left or not view.able or not searched(view.standing.known.experiment):
        return ""
    most = max(found.score.gain for found in view.able) / min(there.rows.values())
    if most >= (1.0 - LEAD) * TOLERATED:
        return ""
    return f"would take {100.0 * most:.1f} % of the repeatability's power at most: {_DIFFER}"


_DIFFER = "minima of the nominal parameters differ by as much"


def blind(standing: Standing, own: Own, simulate: Simulate) -> frozenset[int]:
    r"""Held-out trials in which a law does too little to be seen, all other numbers being what they are.

    Equation: $|W (y - y_0)|^2 < \rho^2$, $y_0$ being what the plant without the law predicts there, and $\rho$ the
        distance from which on a suspect is looked at.
    Validity: what changes in such a recording when all numbers are refitted is the others' doing. A motion of one axis,
        with phases of its own that no other recording shows, had been predicted worse beside a friction of the other
        axis that was right (development), and refused it.
    """
    known, out = standing.known, bare(standing, own, simulate).known
    does = {k: known.residual[k] - out.residual[k] for k in known.experiment.held_out}
    return frozenset(k for k, change in does.items() if float(change @ change) < LEAST_RHO**2)


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
