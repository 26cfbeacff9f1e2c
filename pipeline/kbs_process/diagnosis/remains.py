"""What believed laws leave of the recordings, and whether one more takes enough of it to be one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from kbs_process.diagnosis.detection import Detection, detect
from kbs_process.diagnosis.floor import Floor
from kbs_process.diagnosis.joint import Standing
from kbs_process.diagnosis.thresholds import LEAD, TAKEN, TOLERATED
from kbs_process.diagnosis.view import View


def detected(standing: Standing, floor: Floor, trials: Sequence[int]) -> Detection:
    """Detection on readings from which laws that are columns of the prediction are taken off."""
    known = standing.known
    experiment = known.experiment
    if standing.laws:
        corrected = tuple(
            replace(
                trial,
                measured=trial.measured
                - (standing.shown(k) - standing.predicted[trial.drive].values) * trial.valid[:, None],
            )
            for k, trial in enumerate(experiment.trials)
        )
        experiment = replace(experiment, trials=corrected)
    return detect(experiment, floor, standing.predicted, trials, known=known)


def taken(before: Standing, after: Standing, floor: Floor) -> float:
    """Share that a law takes of what exceeds the floor; all, where nothing does."""
    fit = before.known.experiment.fit
    there = detected(before, floor, fit)
    if not there.left:
        return 1.0
    return 1.0 - max(detected(after, floor, fit).ratio - 1.0, 0.0) / (there.ratio - 1.0)


def too_little(before: Standing, after: Standing, floor: Floor) -> tuple[str, ...]:
    """Return why what a law takes does not tell it from something else; nothing, if it does.

    What two minima of phases and tooth contact leave differs, too, and a law with numbers enough follows that.
    """
    fit = before.known.experiment.fit
    there, here = detected(before, floor, fit), detected(after, floor, fit)
    reasons = []
    share = taken(before, after, floor)
    if not share >= TAKEN:
        reasons.append(
            f"takes {100.0 * share:.0f} % of what exceeds the floor: it follows what something else does"
        )
    if not there.ratio - here.ratio >= TOLERATED:
        reasons.append(_slight(there.ratio - here.ratio))
    return tuple(reasons)


def promises_little(view: View, there: Detection) -> str:
    """Return why no suspect of a view is worth a simulation, where nothing is left and none does much; else ''."""
    if there.left or not view.able:
        return ""
    most = view.able[0].score.gain / there.rows
    return "" if most >= (1.0 - LEAD) * TOLERATED else _slight(most)


def _slight(ratio: float) -> str:
    return (
        f"takes {100.0 * ratio:.1f} % of the floor's power: minima of the known parameters differ by as much"
    )
