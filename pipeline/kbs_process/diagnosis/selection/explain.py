"""How far the known parameters get: near what is known of them first, freely where that explains what is left.

Physics that was left out pulls numbers away from where they are, and a search that follows it ends where neither they
nor what is left are right. So all numbers stay within a few sigmas of their priors at first. If something is left, and
numbers set free explain it, then parameters are off; else what is left is looked at beside the numbers that stayed.
Numbers that had to go so far that a law might be likelier are compared with one: those that stayed are kept for it, or
those that were found beside the error of a clock.

Repeats that were not driven alike, as in a closed loop, differ by what the model makes of their drives too: their floor
is estimated again as soon as the model is about right.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace

import numpy as np

from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.floor import Floor, estimate, smaller
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, Prediction, Simulate
from kbs_process.diagnosis.experiments.thresholds import EXPLAINED, LEAST_RHO, MOST
from kbs_process.diagnosis.nominal import phasing
from kbs_process.diagnosis.nominal.detection import Detection, detect
from kbs_process.diagnosis.nominal.known import NEAR, Known, confined, leapt, refit
from kbs_process.diagnosis.nominal.parameters import prior
from kbs_process.diagnosis.nominal.search import LITTLE, SLIGHT
from kbs_process.diagnosis.nominal.settling import searched
from kbs_process.diagnosis.selection.mistimed import by_another_clock
from kbs_process.diagnosis.smoothing.as_plant import hypothesis_of
from kbs_process.diagnosis.smoothing.search import Smoothed, can_smooth, search
from kbs_process.signals.records import Array

LEAPS = 4  # after a descent
EASED = 4  # passes in a metric that takes what is left for noise
Task = Callable[[str], AbstractContextManager[object]]  # shows that something of some length is done


@dataclass(frozen=True, slots=True, eq=False)
class Explained:
    """How far the known parameters get, and what they leave."""

    floor: Floor
    known: Known
    # Numbers that stayed near their priors, where `known` are implausibly far from theirs, or were refitted beside the
    # error of a clock.
    near: Known | None
    beside: bool  # whether `near` are such numbers: they leave much, and nothing has pulled them
    after: Detection  # with the refitted numbers, over the recordings that these were fitted to
    smoothed: Smoothed | None = None  # what smoothing finds, where it can


def explain(experiment: Experiment, simulate: Simulate, task: Task) -> Explained:
    """Floor, refit of the known parameters, detection of what they leave."""
    if can_smooth(experiment) and (smoothed := _smoothed(experiment, simulate, task)) is not None:
        return smoothed
    return fitted_alone(experiment, simulate, task)


def fitted_alone(experiment: Experiment, simulate: Simulate, task: Task) -> Explained:
    """The same by the plant alone, which has phases to look for."""
    nominal = Hypothesis(experiment.rig, experiment.effects)
    with task("Repeatability"):
        begun = predicted_by(experiment, nominal, simulate)
        floor = floor_of(experiment, begun)
    with task("Phases of cogging, friction and tooth contact"):
        start = phasing.begin(experiment, nominal, floor, simulate)
    slopes, leaps = None, 1
    if not _driven_alike(experiment):
        with task("Repeatability, with a better model"):
            rough = refit(experiment, start, floor, simulate, reach=NEAR, leaps=1)
            rough = _moved_on(_stood(rough, floor), floor, simulate, LEAPS // 2).known
            start, slopes, leaps = rough.hypothesis, rough.slopes, 0
            floor = smaller(floor, floor_of(experiment, predicted_by(experiment, start, simulate)))
    with task("Refitting nominal parameters, near their priors"):
        held = refit(experiment, start, floor, simulate, reach=NEAR, slopes=slopes, leaps=leaps)
        stood = _moved_on(_stood(held, floor), floor, simulate, LEAPS)
    near: Known | None = None
    if stood.after.left and (stood.known.gross or stood.known.stopped):
        with task("Refitting nominal parameters, free"):
            known = stood.known
            start = eased(known, simulate) if known.gross else known.hypothesis
            free = refit(experiment, start, floor, simulate, leaps=0)
            if free.excess < MOST * known.excess:
                # Phases were looked for beside numbers that were wrong.
                start = phasing.begin(experiment, free.hypothesis, floor, simulate)
                free = refit(experiment, start, floor, simulate, leaps=1)
            # Better phases are a part of what is left; numbers that are off have done most of theirs by now.
            hopeful = free.excess < MOST * known.excess
            freed = _moved_on(_stood(free, floor), floor, simulate, LEAPS if hopeful else 0)
        settled = not freed.after.left
        explained = settled or freed.after.ratio - 1.0 < EXPLAINED * (stood.after.ratio - 1.0)
        # Numbers that are off are off in every recording.
        if explained and not _unseen(freed, floor) > _unseen(stood, floor):
            if freed.known.prior_chi2 > stood.known.prior_chi2 + LEAST_RHO**2:
                near = replace(stood.known, chi2_before=_squares(stood.known, begun))
            stood = freed
    elif stood.known.stopped:
        with task("Refitting nominal parameters, free"):
            # What a number cannot reach, a law would do for it.
            free = refit(experiment, stood.known.hypothesis, floor, simulate, leaps=0)
        freed = _moved_on(_stood(free, floor), floor, simulate, LEAPS)
        # Without any being off, searches end as far from each other.
        if freed.known.cost < stood.known.cost - LEAST_RHO**2 and not _unseen(freed, floor) > _unseen(stood, floor):
            stood = freed
    if near is None and stood.after.left and stood.known.gross and searched(experiment):
        with task("Phases again, beside numbers that are about right"):
            stood = _rephased(stood, floor, simulate)
    beside: Known | None = None
    if near is None and stood.after.left and stood.known.gross and searched(experiment):
        with task("Refitting nominal parameters, with a clock that may be wrong"):
            beside = by_another_clock(stood.known, floor, simulate)
        if beside is not None:
            near = replace(beside, chi2_before=_squares(beside, begun))
    known = replace(stood.known, chi2_before=_squares(stood.known, begun))
    return Explained(floor, known, near, beside is not None, stood.after)


def _smoothed(experiment: Experiment, simulate: Simulate, task: Task) -> Explained | None:
    """The same from where smoothing ends, no phases left to look for; None, where it or the plant has no values."""
    with task("Motion, numbers and forces of all recordings"):
        try:
            found = search(experiment)
            start = hypothesis_of(found.beside if found.proposals else found.alone)
        except np.linalg.LinAlgError:
            return None
    with task("Repeatability"):
        there = predicted_by(experiment, start, simulate)
        if not all(np.isfinite(one.values).all() for one in there.values()):
            return None
        begun = predicted_by(experiment, Hypothesis(experiment.rig, experiment.effects), simulate)
        floor = floor_of(experiment, there)
    with task("Refitting nominal parameters"):
        # What is left out pulls numbers that are free.
        reach = NEAR if found.proposals else np.inf
        stood = _stood(refit(experiment, start, floor, simulate, reach=reach, leaps=0, near=True), floor)
    known = replace(stood.known, chi2_before=_squares(stood.known, begun))
    return Explained(floor, known, None, False, stood.after, found)


def _rephased(stood: _Stood, floor: Floor, simulate: Simulate) -> _Stood:
    """A refit from phases that were looked for beside the numbers of another, if that halves what is left.

    They were looked for beside the files' numbers first, whose resonances are elsewhere: late cycles of 40 (spent) had
    ended at three times the floor's power, and end at the floor from there.
    """
    known = stood.known
    start = phasing.begin(known.experiment, known.hypothesis, floor, simulate)
    anew = refit(known.experiment, start, floor, simulate, reach=NEAR, leaps=1)
    return _stood(anew, floor) if anew.excess < MOST * known.excess else stood


def eased(known: Known, simulate: Simulate) -> Hypothesis:
    """Where numbers that are set free go in the metric that takes what is left for noise, as long as that halves it.

    In the noise's metric a resonance that is elsewhere than it was drags whatever makes it weaker, and a descent ends
    there. The metric is taken again from what each pass leaves.
    """
    experiment, here = known.experiment, known.hypothesis
    free = replace(known, parameters=prior(here.rig, experiment.rig, here.effects, known.free))
    for _ in range(EASED):
        gone = confined(free, simulate, np.inf)
        if not gone.excess < free.excess:
            break
        halved = gone.excess < MOST * free.excess
        free = gone
        if not halved:
            break
    return free.hypothesis


def _squares(known: Known, predicted: Mapping[int, Prediction]) -> Array:
    """(trials,) squared lengths of what predictions leave, in the metric of the refit."""
    trials = known.experiment.trials
    left = [
        metric(trial.measured - predicted[trial.drive].values)
        for metric, trial in zip(known.metric, trials, strict=True)
    ]
    return np.array([float(z @ z) for z in left])


@dataclass(frozen=True, slots=True, eq=False)
class _Stood:
    """A refit, and what it leaves of the recordings that it was made of."""

    known: Known
    after: Detection


def _stood(known: Known, floor: Floor) -> _Stood:
    experiment = known.experiment
    return _Stood(known, detect(experiment, floor, known.shown, experiment.fit, known=known))


def _unseen(stood: _Stood, floor: Floor) -> float:
    """Power over the floor's that a refit leaves of recordings which it was not made of; 0 without any."""
    experiment, known = stood.known.experiment, stood.known
    if not experiment.held_out:
        return 0.0
    return detect(experiment, floor, known.shown, experiment.held_out, known=known).ratio


def _moved_on(stood: _Stood, floor: Floor, simulate: Simulate, leaps: int) -> _Stood:
    """Leap from minimum to minimum: once, and on while something is left or numbers are strained, and leaps gain.

    A wrong edge of tooth contact may leave nothing to see, and others make up for it.
    """
    for number in range(leaps):
        # What is missing makes wrong phases as good as right ones.
        wanting = number == 0 or stood.after.left or stood.known.strained
        if not wanting or stood.known.gross:
            break
        known = stood.known
        moved = leapt(known, simulate, smooth=number == 0)
        if moved is known:
            break
        gained = known.cost - moved.cost
        if gained > 0.0:
            stood = _stood(moved, floor)
        if not gained > max(LITTLE, SLIGHT * known.excess):
            break
    return stood


def _driven_alike(experiment: Experiment) -> bool:
    return all(len({experiment.trials[k].drive for k in members}) == 1 for members in experiment.repeats)


def predicted_by(experiment: Experiment, hypothesis: Hypothesis, simulate: Simulate) -> dict[int, Prediction]:
    """Predictions of all drives."""
    return dict(enumerate(simulate([(drive, hypothesis) for drive in range(len(experiment.drives))])))


def floor_of(experiment: Experiment, predicted: dict[int, Prediction]) -> Floor:
    """The floor by what predictions leave."""
    left = {k: t.measured - predicted[t.drive].values for k, t in enumerate(experiment.trials)}
    return estimate(experiment, left)
