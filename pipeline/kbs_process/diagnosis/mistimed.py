"""Numbers that a clock which is wrong has not pulled: refitted to recordings that are stamped anew.

A clock's error shows wherever anything moves, so all known numbers make up for it, phases most, and a search that
begins there does not come back. As it costs little to stamp recordings anew, the one that leaves least beside numbers
near their priors is tried first, and numbers are looked for from the files' on, as if it were right.
"""

from __future__ import annotations

from dataclasses import replace

from kbs_process.diagnosis import phasing
from kbs_process.diagnosis.clocks import by_a_right_clock, height_of, timed
from kbs_process.diagnosis.experiment import Experiment
from kbs_process.diagnosis.floor import Floor
from kbs_process.diagnosis.hypothesis import Hypothesis, Simulate
from kbs_process.diagnosis.joint import Standing
from kbs_process.diagnosis.known import Known, as_it_is, confined, refit
from kbs_process.diagnosis.screen import Catalogued, Found, Suspect
from kbs_process.diagnosis.thresholds import CLOSE, MOST
from kbs_process.diagnosis.view import View

_TIMES = 2  # that recordings are stamped anew, each time by what the numbers of before leave


def by_another_clock(known: Known, floor: Floor, simulate: Simulate, reach: float) -> Known | None:
    """Known numbers as they are beside the error of a clock that does most of what is to be done; None without one.

    They go no farther than `reach` sigmas; what they leave is that of the recordings as they are.
    """
    here, right = confined(known, simulate, CLOSE), None
    most = MOST * known.excess
    for _ in range(_TIMES):
        found = _clock(here)
        if found is None:
            break
        experiment = _stamped_anew(here, found)
        nominal = Hypothesis(experiment.rig, experiment.effects)
        start = phasing.begin(experiment, nominal, floor, simulate)
        again = refit(experiment, start, floor, simulate, reach=reach, leaps=1)
        if not again.excess < most:
            break
        most = again.excess
        right = as_it_is(replace(again, experiment=known.experiment), simulate)
        if not again.gross:
            break
        here = right
    return right


def _clock(known: Known) -> Found | None:
    """The error of a clock, one of all recordings, that does most of what is to be done; None if none does."""
    view = View.of(Standing(known, known.shown, {}), _of_all, linear=False)
    candidates = view.screening.candidates
    if not candidates:
        return None
    tried = [timed(view.bench, one, view.suspects) for one in candidates]
    best = max(tried, key=lambda one: one.score.gain)
    # Beside numbers refitted to first order, which do a part of what is to be done in any case.
    alone = height_of(view.bench, view.bench.background.z) + known.prior_chi2 - known.fit_rows
    return best if alone > 0.0 and alone - best.score.gain <= MOST * alone else None


def _of_all(suspect: Suspect) -> bool:
    return isinstance(suspect, Catalogued) and suspect.of_every_clock


def _stamped_anew(known: Known, found: Found) -> Experiment:
    suspect, experiment = found.suspect, known.experiment
    assert isinstance(suspect, Catalogued)
    trials = []
    for k, trial in enumerate(experiment.trials):
        late = suspect.late(experiment.reference(trial.trajectory))[:, 0] * float(found.score.amplitude[0])
        trials.append(replace(trial, measured=by_a_right_clock(suspect, known, k, late)[0]))
    return replace(experiment, trials=tuple(trials))
