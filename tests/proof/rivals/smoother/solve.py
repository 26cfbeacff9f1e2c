"""The answer of the smoother: forces at ports first, then the effects that explain them on recordings held out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
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
from proof.answer import Answer, Claim, Estimate, Moved, Suspect
from proof.answer import Candidate as Claimed
from proof.rivals.case import Array
from proof.rivals.smoother.fit import Quadratic, State, step
from proof.rivals.smoother.intensities import powers
from proof.rivals.smoother.problem import Problem
from proof.rivals.smoother.screen import Scored, Screen

METHOD = "smoother"
WIDER, OF_JOINT = 10.0, 3.0  # times a reading's noise that forces are, to begin with; those of joints times as much
STEPS = 25
# Of a fit's phases: all is statics; forces are estimated; all is free. The share that forces have of a model by itself.
STIFF = (0.1, 0.03, 0.01)
SETTLED = 100.0  # sigmas of all unknowns together that a step goes, below which forces are estimated
ARRIVED = 3.0  # below which it is the last
LEAST = 1e-3  # of what they are to begin with: smaller ones are nothing beside a reading's noise
CHANGE = (0.3, 1.5)  # of a force's sigma in a step
BEYOND = 1.6  # times a step of its logarithm, at most; and by what it changes where a step went beyond, and else
ONWARD = (0.5, 1.2)
KNOWN = 0.2  # of its logarithm, below which a force's sigma is known
DETECTED = 400.0  # of the cost, that an effect takes of all recordings: what the equations here leave out takes less
SHARE = 0.25  # of its gain for each sample, that an effect of each recording's own has on recordings held out
FORETOLD = 0.5  # of what another would take there, that it takes
MOST = 3  # effects
OFF = 4.0  # sigmas
LEADERS = 12  # laws at a place, of which shapes are refined and recordings held out are asked
BEHIND = 0.2  # of the first's worth, with less of which one is no leader
NEXT = 2  # alternatives that are named
ALIKE = 9.0  # of the cost: what differs by less is not told apart, nor
INEXACT = 0.02  # what differs by less than this share of it: columns are right to first order


def solve(folder: Path) -> Answer:
    """Answer a trial; see the package."""
    begin = monotonic()
    experiment = experiment_of(load_campaign(folder, checksums=False), SilentProgress())
    fitted = Problem(experiment, list(experiment.fit))
    state = settled(fitted)
    left = powers(fitted, state, Quadratic.of(fitted, state))
    finds, after = _finds(fitted, state, _Judge.of(experiment, fitted, state), left.of_all)
    moved = _moved(fitted, state)
    return Answer(
        method=METHOD,
        trial=folder.name,
        detected=bool(finds),
        verdict="physics" if finds else "parameters off" if moved else "none",
        moved=() if finds else moved,
        finds=finds,
        seconds=monotonic() - begin,
    )


def settled(problem: Problem, sigma: Array | None = None) -> State:
    """Fit with forces of `sigma`; without, with large ones first, then with those that repeats differ by.

    What shows while the rig moves alone is held until forces are known: beside large ones nothing tells it.
    """
    state = State.of(problem, _forces(problem) if sigma is None else sigma)
    wrong, phase = np.inf, 0
    least = LEAST * _forces(problem)
    reach, before = np.ones(problem.rows)[problem.forces], np.zeros(problem.rows)[problem.forces]
    if sigma is not None:
        wrong, phase = 0.0, 2
    for _ in range(STEPS):
        state.idealise(problem, STIFF[phase])
        quadratic = Quadratic.of(problem, state)
        if phase and sigma is None:
            ratio = np.sqrt(powers(problem, state, quadratic).noise[problem.forces])
            ratio = np.maximum(ratio, least / state.sigma[problem.forces])
            wrong = float(np.abs(np.log(np.clip(ratio, *CHANGE))).max())
            reach *= np.where(np.log(ratio) * before < 0.0, *ONWARD)
            before = np.log(ratio)
            state.sigma[problem.forces] *= np.clip(ratio ** np.minimum(reach, BEYOND), *CHANGE)
        if phase == 1 and wrong > KNOWN:
            state.smooth(problem)
            continue
        length = step(problem, state, quadratic, None if phase == 2 else ~problem.dynamic)
        if phase == 0 and length < SETTLED:
            phase = 1
        elif phase == 1:
            phase = 2
        elif phase == 2 and length < ARRIVED and wrong < KNOWN:
            break
    return state


def _forces(problem: Problem) -> Array:
    """Sigmas (forces,) to begin with: what a reading's noise is as a force."""
    force, torque = problem.sigma[:3].mean(), problem.sigma[3:6].mean()
    mass = sum(float(body.mass) for body in problem.rig.bodies)
    return WIDER * np.repeat([torque, OF_JOINT * torque, force / mass], [3, problem.joints, 3])


def _finds(problem: Problem, state: State, judge: _Judge | None, power: Array) -> tuple[tuple[Claim, ...], Array]:
    """Effects, one after the other: each the one that recordings of the fit and those held out together show most.

    And the power (rows,) that they leave. `power` is what is left in each row without any. What comes again and no
    number takes up counts as noise until an effect explains it.
    """
    finds: list[Claim] = []
    known: list[Candidate] = []
    forces, base, before = problem.forces, state.sigma.copy(), 0.0
    excess = power
    while len(finds) < MOST:
        state.sigma[forces] = (base * np.sqrt(np.maximum(excess, 1.0)))[forces]
        screen = Screen(problem, state)
        held = None if judge is None else judge.screen(state.sigma[forces])
        taken = {_suspect(one) for one in known}  # another shape of one is no second effect
        chosen = [one for one in screen.candidates() if _suspect(one) not in taken]
        seen = [one.candidate for one in _first_of_each(screen.survey().scored(chosen, known))]
        leaders = [screen.refined(one, known) for one in screen.scored(seen, known)]
        if held is not None:
            before = held.predicted(screen.scored(known[-1:], known[:-1])[0], known[:-1]) if known else 0.0
            leaders = [replace(one, foreseen=held.predicted(one, known) - before) for one in leaders]
            leaders = [one for one in leaders if judge.confirms(one, held)]
        leaders.sort(key=lambda one: -one.worth)
        if not leaders or leaders[0].worth < DETECTED:
            break
        apart = max(ALIKE, INEXACT * leaders[0].worth)
        alike = [one for one in leaders if one.worth > leaders[0].worth - apart]
        best = max(alike, key=partial(_odds, apart=apart, tried=Counter((one.name, one.site) for one in chosen)))
        finds.append(_claim(best, leaders, alike, screen.estimated(best, known)))
        left, all_ = (
            sum(np.sum(z**2, axis=0) for z in part) for part in (screen.explained(best, known), screen.unexplained())
        )
        excess = power * left / all_
        known.append(best.candidate)
    return tuple(finds), excess


def _first_of_each(scored: Sequence[Scored]) -> list[Scored]:
    """The best shape of each law at each place, of the first few."""
    first: dict[tuple[str, str], Scored] = {}
    for one in scored:
        first.setdefault((one.candidate.name, one.candidate.site), one)
    leaders = list(first.values())[:LEADERS]
    return [one for one in leaders if one.worth > BEHIND * leaders[0].worth]


@dataclass(frozen=True, slots=True, eq=False)
class _Judge:
    """Recordings held out, with the numbers that were fitted, as well as they are known; what is their own is free."""

    problem: Problem
    state: State
    samples: float  # over those of the recordings that were fitted

    @classmethod
    def of(cls, experiment: Experiment, fitted: Problem, state: State) -> _Judge | None:
        """None where no recording is held out."""
        if not experiment.held_out:
            return None
        problem = Problem(experiment, list(experiment.held_out))
        common = problem.own[0].start
        # As well as they are known by now; as if none knew of another.
        known = Quadratic.of(fitted, state).sigma(fitted.spread)
        problem.prior[:common], problem.spread[:common] = state.x[:common], known[:common]
        own = settled(problem, state.sigma[problem.forces])
        counted = [sum(float(r.weight.sum()) for r in p.recordings) for p in (problem, fitted)]
        return cls(problem, own, counted[0] / counted[1])

    def screen(self, forces: Array) -> Screen:
        """With forces of these sigmas."""
        self.state.sigma[self.problem.forces] = forces
        return Screen(self.problem, self.state)

    def confirms(self, one: Scored, held: Screen) -> bool:
        """Whether they show an effect, as far as it shows there."""
        if one.candidate.effect.each_trial:
            return one.foreseen > SHARE * self.samples * one.gain
        foretold = held.foretold(one)
        return foretold < ALIKE or one.foreseen > FORETOLD * foretold


def _odds(one: Scored, apart: float, tried: Mapping[tuple[str, str], int]) -> float:
    """Twice the logarithm of its odds among those that are not told apart: what was tried more often is less likely.

    What sizes of amplitudes say has its part in what it is worth already, all of which counts as much less as columns
    are inexact.
    """
    prior = one.likely - 2.0 * float(np.log(tried[one.candidate.name, one.candidate.site]))
    return (one.worth - one.likely) * ALIKE / apart + prior


def _claim(best: Scored, leaders: Sequence[Scored], alike: Sequence[Scored], numbers: tuple[Estimate, ...]) -> Claim:
    """What is claimed of an effect, with the next best of other places or physics, and what is not told from it."""
    own = _suspect(best.candidate)
    others = list(dict.fromkeys(told for one in leaders if (told := _suspect(one.candidate)) != own))
    same = {_suspect(one.candidate) for one in alike}
    following = others[:NEXT]
    return Claim(
        port=own.port,
        axis=own.axis,
        channels=own.channels,
        family=own.family,
        law=best.candidate.name,
        parameters=numbers,
        alternatives=tuple(Claimed(**structs.asdict(one)) for one in following),
        indistinguishable_from=tuple(told for told in others if told in same),
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
