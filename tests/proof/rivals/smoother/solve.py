"""The answer of the smoother: forces at ports first, then the effects that explain them on recordings held out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from time import monotonic

import numpy as np
from msgspec import structs

from kbs_process.campaign.load import load_campaign
from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.screening.suspects import Candidate
from kbs_process.plant.sensing import BY
from kbs_process.progress import SilentProgress
from kbs_process.studies.diagnose.reading import experiment_of
from proof.answer import Answer, Claim, Moved, Suspect
from proof.answer import Candidate as Claimed
from proof.rivals.case import Array
from proof.rivals.smoother.fit import State, descend
from proof.rivals.smoother.problem import Problem
from proof.rivals.smoother.screen import Scored, Screen

METHOD = "smoother"
LOOSE = (0.1, 0.5, 0.02)  # N m of the plate, N m of a joint, m/s^2 of the floor: anything fits
LEAST = (1e-4, 5e-4, 1e-5)
WIDER = 2.0  # times what repeats differ by
STEPS = 5
DETECTED = 100.0  # of the cost, that an effect takes
SHARE = 0.25  # of its gain for each sample, that it has on recordings held out
MOST = 3  # effects
OFF = 4.0  # sigmas
NEXT = 2  # alternatives that are named
ALIKE = 9.0  # of the cost: laws that differ by less are not told apart


def solve(folder: Path) -> Answer:
    """Answer a trial; see the package."""
    begin = monotonic()
    experiment = experiment_of(load_campaign(folder, checksums=False), SilentProgress())
    fitted = Problem(experiment, list(experiment.fit))
    state = settled(fitted)
    screen = Screen(fitted, state)
    judge = _held_out(experiment, fitted, state)
    chosen, finds = screen.candidates(), []
    known: list[Candidate] = []
    while len(known) < MOST:
        scored = screen.scored(chosen, known)
        best = next((one for one in scored[:20] if judge is None or judge.confirms(one)), None)
        if best is None or best.gain < DETECTED:
            break
        finds.append(_claim(best, scored))
        known.append(best.candidate)
        own = _suspect(best.candidate)
        chosen = [one for one in chosen if _suspect(one) != own]  # another shape of it is no second effect
    moved = _moved(fitted, state)
    return Answer(
        method=METHOD,
        trial=folder.name,
        detected=bool(finds),
        verdict="physics" if finds else "parameters off" if moved else "none",
        moved=() if finds else moved,
        finds=tuple(finds),
        seconds=monotonic() - begin,
    )


def settled(problem: Problem) -> State:
    """Fit with forces that may be anything, then with those that repeats differ by."""
    state = State.of(problem, _forces(problem, LOOSE))
    descend(problem, state, STEPS, ~problem.scaling)
    differ = _differ(problem, state)
    if differ is not None:
        state.sigma[problem.forces] = np.maximum(WIDER * differ, _forces(problem, LEAST))
        descend(problem, state, STEPS, np.ones(len(problem.prior), dtype=bool))
    return state


def _forces(problem: Problem, levels: Sequence[float]) -> Array:
    return np.repeat(levels, [3, problem.joints, 3])


def _differ(problem: Problem, state: State) -> Array | None:
    """Rms by which the forces of repeats differ, over sqrt 2; None where nothing was repeated."""
    left = [part[:, problem.forces] for part in state.residuals(problem)]
    trials = problem.experiment.trials
    by_trajectory: dict[int, list[int]] = {}
    for k, recording in enumerate(problem.recordings):
        by_trajectory.setdefault(trials[recording.trial].trajectory, []).append(k)
    apart = []
    for one, other in (pair for own in by_trajectory.values() for pair in pairwise(own)):
        a, b = problem.recordings[one], problem.recordings[other]
        first, end = max(a.first, b.first), min(a.first + a.n, b.first + b.n)
        both = [(left[k] * r.weight[:, None])[first - r.first : end - r.first] for k, r in ((one, a), (other, b))]
        apart.append((both[0] - both[1]) / np.sqrt(2.0))
    return np.asarray(np.sqrt(np.mean(np.concatenate(apart) ** 2, axis=0))) if apart else None


@dataclass(frozen=True, slots=True, eq=False)
class _Judge:
    """Recordings held out, at the numbers that were fitted; what is their own is free."""

    screen: Screen
    samples: float  # over those of the recordings that were fitted

    def confirms(self, one: Scored) -> bool:
        """Whether an effect, at the amplitudes that were fitted, predicts recordings held out."""
        if one.candidate.effect.each_trial:
            (again,) = self.screen.scored([one.candidate])
            return again.gain > SHARE * self.samples * one.gain
        return self.screen.predicted(one) > SHARE * self.samples * one.gain


def _held_out(experiment: Experiment, fitted: Problem, state: State) -> _Judge | None:
    if not experiment.held_out:
        return None
    problem = Problem(experiment, list(experiment.held_out))
    common = problem.own[0].start
    problem.prior[:common], problem.spread[:common] = state.x[:common], 1e-6 * problem.spread[:common]
    own = State.of(problem, state.sigma[problem.forces])
    descend(problem, own, STEPS, np.arange(len(problem.prior)) >= common)
    counted = [sum(float(r.weight.sum()) for r in p.recordings) for p in (problem, fitted)]
    return _Judge(Screen(problem, own), counted[0] / counted[1])


def _claim(best: Scored, scored: Sequence[Scored]) -> Claim:
    """What is claimed of an effect, with the next best of other places or physics."""
    own = _suspect(best.candidate)
    others: dict[Suspect, Scored] = {}
    for one in scored:
        told = _suspect(one.candidate)
        if told != own and told not in others:
            others[told] = one
    alike = tuple(told for told, one in others.items() if best.worth - one.worth < ALIKE)
    following = list(others)[:NEXT]
    return Claim(
        port=own.port,
        axis=own.axis,
        channels=own.channels,
        family=own.family,
        law=best.candidate.name,
        alternatives=tuple(Claimed(**structs.asdict(one)) for one in following),
        indistinguishable_from=alike,
    )


def _suspect(candidate: Candidate) -> Suspect:
    law = candidate.effect
    channels = tuple(candidate.site.split(BY)) if law.port.of_channel else ()
    axis = "" if law.port.of_channel or law.port.beneath else candidate.site
    return Suspect(port=law.port_word, axis=axis, channels=channels, family=law.family)


def _moved(problem: Problem, state: State) -> tuple[Moved, ...]:
    """Numbers of the rig that had to move."""
    off = ((state.x - problem.prior) / problem.spread)[problem.of_rig]
    entries = zip(problem.elements.names, state.x[problem.of_rig], problem.spread[problem.of_rig], off, strict=True)
    return tuple(
        Moved(name=name, value=float(value), sigma=float(sigma), sigmas=float(by))
        for name, value, sigma, by in entries
        if abs(by) > OFF
    )
