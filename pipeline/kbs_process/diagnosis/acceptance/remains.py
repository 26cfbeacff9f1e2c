"""What believed laws leave of the recordings, and whether one more takes enough of it to be one."""

from __future__ import annotations

from collections.abc import Collection

from kbs_process.diagnosis.experiments.floor import Floor
from kbs_process.diagnosis.experiments.hypothesis import Simulate
from kbs_process.diagnosis.experiments.thresholds import (
    EVERYWHERE,
    LEAD,
    LEAST_RHO,
    TAKEN,
    TAKEN_UNUSED,
    TOLERATED,
    UNFORESEEN,
)
from kbs_process.diagnosis.nominal.detection import Detection
from kbs_process.diagnosis.nominal.joint import Own, Standing, bare
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.diagnosis.nominal.settling import detected, searched
from kbs_process.diagnosis.proposing.view import View


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
        reasons.append(f"takes {100.0 * share:.0f} % of what exceeds the floor: it follows what something else does")
    left = here.ratios
    most = max(ratio - left[trajectory] for trajectory, ratio in there.ratios.items())
    # What known numbers had taken up shows where they are.
    relieved = before.known.strained and not after.known.strained
    if searched(experiment) and not (most >= TOLERATED or sigmas >= EVERYWHERE or relieved):
        reasons.append(f"takes {100.0 * most:.1f} % of the floor's power: {_DIFFER}")
    elif not there.left and not before.known.cost - after.known.cost >= LEAST_RHO**2:
        reasons.append("known numbers alone are as likely")
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
            reasons.append(f"takes {share:.0f} % of what {after.experiment.trials[k].name} exceeds the floor by")
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
    return f"would take {100.0 * most:.1f} % of the floor's power at most: {_DIFFER}"


_DIFFER = "minima of the known parameters differ by as much"


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
