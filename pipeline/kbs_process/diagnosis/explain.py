"""How far the known parameters get: near what is known of them first, freely where that explains what is left.

Physics that was left out pulls numbers away from where they are, and a search that follows it ends where neither they
nor what is left are right. So all numbers stay within a few sigmas of their priors at first. If something is left, and
numbers set free explain it, then parameters are off; else what is left is looked at beside the numbers that stayed.
"""

from __future__ import annotations

import numpy as np

from kbs_process.diagnosis.detection import Detection, detect
from kbs_process.diagnosis.experiment import Experiment
from kbs_process.diagnosis.floor import Floor
from kbs_process.diagnosis.hypothesis import Hypothesis, Prediction, Simulate
from kbs_process.diagnosis.known import MOVED, Known, refit
from kbs_process.diagnosis.parameters import Slopes
from kbs_process.diagnosis.thresholds import DETECTED, EXPLAINED


def explained(
    experiment: Experiment,
    start: Hypothesis,
    floor: Floor,
    simulate: Simulate,
    *,
    slopes: dict[int, Slopes] | None = None,
) -> tuple[Known, dict[int, Prediction], Detection]:
    """Return the refitted numbers, what they predict (by drive), and what is left of the fit trials.

    With `slopes` at `start`, that is a minimum under another floor, and phases are not looked for.
    """
    first = refit(experiment, start, floor, simulate, reach=MOVED, slopes=slopes, leaps=slopes is None)
    near = _judged(first, floor, simulate)
    known, _, left = near
    at_bound = np.abs(np.nan_to_num(known.moved)) > 0.99 * MOVED
    if left.log_p > np.log(DETECTED) or not at_bound.any():
        return near
    free = _judged(
        refit(experiment, known.hypothesis, floor, simulate, slopes=known.slopes, leaps=False),
        floor,
        simulate,
    )
    settled = free[2].log_p > np.log(DETECTED) or free[2].ratio - 1.0 < EXPLAINED * (left.ratio - 1.0)
    return free if settled else near


def _judged(known: Known, floor: Floor, simulate: Simulate) -> tuple[Known, dict[int, Prediction], Detection]:
    experiment = known.experiment
    drives = range(len(experiment.drives))
    predicted = dict(enumerate(simulate([(drive, known.hypothesis) for drive in drives])))
    return known, predicted, detect(experiment, floor, predicted, experiment.fit, known=known)
