"""Numbers that a clock which is wrong has not pulled: refitted to recordings that are stamped anew.

A clock's error shows wherever anything moves, so all known numbers make up for it, phases most, and a search that
begins there does not come back. As it costs little to stamp recordings anew, the one that leaves least beside numbers
near their priors is tried first, and numbers are looked for from the files' on, as if it were right.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from kbs_process.diagnosis.acceptance.finding import of_clock
from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.floor import Floor
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, Simulate
from kbs_process.diagnosis.experiments.thresholds import CLOSE, MOST, TOLERATED
from kbs_process.diagnosis.nominal import phasing
from kbs_process.diagnosis.nominal.joint import Standing
from kbs_process.diagnosis.nominal.known import NEAR, Known, as_it_is, confined, refit
from kbs_process.diagnosis.proposing.clocks import by_a_right_clock, height_of, timed
from kbs_process.diagnosis.proposing.view import View
from kbs_process.diagnosis.screening.screen import Catalogued, Found
from kbs_process.diagnosis.selection.each_recording import gained_by_chance, taken_off, unread_only
from kbs_process.diagnosis.side_by_side import side_by_side

_TIMES = 3  # that recordings are stamped anew, each time by what the numbers of before leave


def by_another_clock(known: Known, floor: Floor, simulate: Simulate) -> Known | None:
    """Known numbers as they are beside the error of a clock that does most of what is to be done; None without one.

    They go no farther than `NEAR` sigmas; what they leave is that of the recordings as they are.
    """
    here, right = confined(known, simulate, CLOSE), None
    most = MOST * known.excess
    for _ in range(_TIMES):
        experiment = _stamped_anew(here)
        if experiment is None:
            break
        nominal = Hypothesis(experiment.rig, experiment.effects)
        start = phasing.begin(experiment, nominal, floor, simulate)
        again = refit(experiment, start, floor, simulate, reach=NEAR, leaps=1)
        if not again.excess < most:
            break
        most = again.excess
        right = as_it_is(replace(again, experiment=known.experiment), simulate)
        if again.excess < TOLERATED * again.fit_rows:
            break
        here = right
    return right


def _stamped_anew(known: Known) -> Experiment | None:
    """The recordings stamped by a clock that is right where one error of one does most of what is to be done.

    The error is the same in all recordings, or a jump or a wandering, which each has of its own; None, if none does so.
    """
    view = View.of(Standing(known, known.shown, {}), of_clock, linear=False)
    bench = view.bench
    # Beside numbers refitted to first order, which do a part of what is to be done in any case.
    alone = height_of(bench, bench.background.z) + known.prior_chi2 - known.fit_rows
    stamped = side_by_side(partial(_stamped, view), view.screening.candidates)
    gain, experiment = max(stamped, key=lambda one: one[0], default=(0.0, known.experiment))
    return experiment if alone > 0.0 and alone - gain <= MOST * alone else None


def _stamped(view: View, found: Found) -> tuple[float, Experiment]:
    """Gain of -2 log likelihood by the error of a clock, and what recordings are without it."""
    return _each_stamped(view, found) if found.suspect.each_trial else _all_stamped(view, found)


def _all_stamped(view: View, found: Found) -> tuple[float, Experiment]:
    """`_stamped`, of an error that all recordings share."""
    known, found = view.standing.known, timed(view.bench, found, view.suspects)
    suspect, experiment = found.suspect, known.experiment
    assert isinstance(suspect, Catalogued)
    trials = []
    for k, trial in enumerate(experiment.trials):
        late = suspect.late(experiment.reference(trial.trajectory))[:, 0] * float(found.score.amplitude[0])
        trials.append(replace(trial, measured=by_a_right_clock(suspect, known, k, late)[0]))
    return found.score.gain, replace(experiment, trials=tuple(trials))


def _each_stamped(view: View, found: Found) -> tuple[float, Experiment]:
    """`_stamped`, of an error of each recording's own, less what so many numbers gain by chance."""
    bench, known = view.bench, view.standing.known
    without = taken_off(found, view).standing.known
    assert isinstance(found.suspect, Catalogued)
    erased = unread_only(found.suspect, known)
    left = {k: without.residual[k] for k in erased}
    gained = height_of(bench, erased) - height_of(bench, left)
    return gained - gained_by_chance(found.suspect, known), without.experiment
