"""The answer of the smoother: forces at ports first, then the effects that explain them on recordings held out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
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
CHANGE = (0.3, 1.5)  # of a force's sigma in a step
KNOWN = 0.2  # of its logarithm, below which a force's sigma is known
DETECTED = 100.0  # of the cost, that an effect takes
SHARE = 0.25  # of its gain for each sample, that an effect of each recording's own has on recordings held out
FORETOLD = 0.5  # of what another would take there, that it takes
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
    left = powers(fitted, state, Quadratic.of(fitted, state))
    # What comes again and no number takes up counts as noise until an effect explains it.
    state.sigma[fitted.forces] *= np.sqrt(np.maximum(left.of_all, 1.0))[fitted.forces]
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


def settled(problem: Problem, sigma: Array | None = None) -> State:
    """Fit with forces of `sigma`; without, with large ones first, then with those that repeats differ by.

    What shows while the rig moves alone is held until forces are known: beside large ones nothing tells it.
    """
    state = State.of(problem, _forces(problem) if sigma is None else sigma)
    length = wrong = np.inf
    phase = 0 if sigma is None else 2
    for _ in range(STEPS):
        state.idealise(problem, STIFF[phase])
        quadratic = Quadratic.of(problem, state)
        if phase and sigma is None:
            power = powers(problem, state, quadratic).noise[problem.forces]
            ratio = np.clip(np.sqrt(power), *CHANGE)
            state.sigma[problem.forces] *= ratio
            wrong = float(np.abs(np.log(ratio)).max())
            quadratic = Quadratic.of(problem, state)
        length = step(problem, state, quadratic, None if phase == 2 else ~problem.dynamic)
        if phase == 0 and length < SETTLED:
            phase = 1
        elif phase == 1 and wrong < KNOWN:
            phase = 2
        elif phase == 2 and length < ARRIVED and (sigma is not None or wrong < KNOWN):
            break
    return state


def _forces(problem: Problem) -> Array:
    """Sigmas (forces,) to begin with: what a reading's noise is as a force."""
    force, torque = problem.sigma[:3].mean(), problem.sigma[3:6].mean()
    mass = sum(float(body.mass) for body in problem.rig.bodies)
    return WIDER * np.repeat([torque, OF_JOINT * torque, force / mass], [3, problem.joints, 3])


@dataclass(frozen=True, slots=True, eq=False)
class _Judge:
    """Recordings held out, at the numbers that were fitted; what is their own is free."""

    screen: Screen
    samples: float  # over those of the recordings that were fitted

    def confirms(self, one: Scored) -> bool:
        """Whether recordings held out show an effect, at the amplitudes that were fitted, as far as it shows there."""
        if one.candidate.effect.each_trial:
            (again,) = self.screen.scored([one.candidate])
            return again.gain > SHARE * self.samples * one.gain
        gained, foretold = self.screen.predicted(one)
        return foretold < DETECTED or gained > FORETOLD * foretold


def _held_out(experiment: Experiment, fitted: Problem, state: State) -> _Judge | None:
    if not experiment.held_out:
        return None
    problem = Problem(experiment, list(experiment.held_out))
    common = problem.own[0].start
    problem.prior[:common], problem.spread[:common] = state.x[:common], 1e-6 * problem.spread[:common]
    own = settled(problem, state.sigma[problem.forces])
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
