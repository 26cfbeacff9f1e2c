"""What smoothing finds: forces at ports first, then the effects that explain them on recordings held out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.screening.suspects import Candidate
from kbs_process.diagnosis.smoothing.basis import BAND_HZ
from kbs_process.diagnosis.smoothing.drive import NEEDED, WRITTEN
from kbs_process.diagnosis.smoothing.fit import NEAR, REACH, Fitted, Quadratic, State, step
from kbs_process.diagnosis.smoothing.intensities import powers
from kbs_process.diagnosis.smoothing.problem import Problem
from kbs_process.diagnosis.smoothing.screen import Scored, Screen
from kbs_process.rig.model import LAB
from kbs_process.signals.records import Array

WIDER, OF_JOINT = 10.0, 3.0  # times a reading's noise that forces are, to begin with; those of joints times as much
SHAKEN = 25.0  # rad/s, at which the floor shakes a plate most
STEPS = 25
TRIED = 4  # steps beside an effect that is compared with others, or of which the shape goes on; all, once it is chosen
# The share that forces have of a model by itself: at first, once forces are known, and when all is free. With more of
# them, what rings for no reason but noise is in it, and stiffness and damping follow that.
STIFF = (0.1, 0.03, 0.001)
SETTLED = 100.0  # sigmas of all unknowns together that a step goes, below which forces are estimated
ARRIVED = 3.0  # below which it is the last
PATIENCE = 3  # steps that gain no more than such a one
LEAST = 1e-3  # of what they are to begin with: smaller ones are nothing beside a reading's noise
CHANGE = (0.3, 1.5)  # of a force's sigma in a step
BEYOND = 1.6  # times a step of its logarithm, at most; and by what it changes where a step went beyond, and else
ONWARD = (0.5, 1.2)
KNOWN = 0.2  # of its logarithm, below which a force's sigma is known
DETECTED = 400.0  # of the cost, that an effect takes of all recordings: what the equations here leave out takes less
# Of its gain for each sample, or of all that is left there, that an effect of each recording's own takes of recordings
# held out.
SHARE = 0.25
FORETOLD = 0.25  # of what another would take there, that it takes: what is not there takes as much less than nothing
MOST = 3  # effects
RESHAPED = 8  # times that a shape goes on beside all numbers, at most
LEADERS = 12  # laws at a place, of which shapes are refined and recordings held out are asked
BEHIND = 0.2  # of the first's worth, with less of which one is no leader
ALIKE = 9.0  # of the cost: what differs by less is not told apart
# Of what an effect is worth: what differs by less is fitted, as columns are right to first order; and what is worth
# less beside it may be what its law lacks.
INEXACT = 0.02
RIVALS = 3  # of other places or physics, that are


@dataclass(frozen=True, slots=True, eq=False)
class Proposal:
    """An effect that recordings show, fitted and held out."""

    candidate: Candidate
    others: tuple[Candidate, ...]  # of other places or physics, best first
    alike: tuple[Candidate, ...]  # of them, what is not told from it


@dataclass(frozen=True, slots=True, eq=False)
class Smoothed:
    """What smoothing finds: effects, with the rig's numbers beside them and without any."""

    proposals: tuple[Proposal, ...]
    beside: Fitted
    alone: Fitted


def can_smooth(experiment: Experiment) -> bool:
    """Whether there is all that `Problem` needs.

    A transducer in the laboratory whose plate turns and whose noise is stated, with all six channels; drives with all
    effects that are written here, encoders that round, fields that are known; the band; effects that act in all
    recordings.
    """
    rig, transducer = experiment.rig, experiment.rig.transducer
    driven = set(experiment.effects) >= WRITTEN and all(
        joint.encoder is not None
        and float(joint.encoder.step) > 0.0
        and joint.drive is not None
        and joint.drive.parameters.keys() >= NEEDED
        for joint in rig.joints
    )
    fields = all(
        drive.schedule is not None and (rig.controller is None or drive.schedule.field is not None) and not drive.absent
        for drive in experiment.drives
    )
    whole = experiment.wrench_channels == 6 and len(experiment.channels) == 6 + len(rig.joints)
    turns = transducer.stiffness is not None and transducer.on == LAB
    stated = bool(np.all(np.hypot(transducer.noise.value, transducer.resolution.value) > 0.0))
    return driven and fields and whole and turns and stated and experiment.highest_Hz >= BAND_HZ


def search(experiment: Experiment) -> Smoothed:
    """Look for what a model leaves out of recordings that `Problem` can describe."""
    fitted = Problem(experiment, list(experiment.fit))
    state = settled(fitted)
    alone = Fitted.of(fitted, replace(state, x=state.x.copy(), sigma=state.sigma.copy()))
    found = _found(fitted, state, _Judge.of(experiment, fitted, state))
    return Smoothed(*found, alone)


def settled(problem: Problem, sigma: Array | None = None, begun: State | None = None, most: int = STEPS) -> State:
    """Fit with forces of `sigma`; without, with large ones first, then with those that repeats differ by.

    What shows while the rig moves alone is held until forces are known: beside large ones nothing tells it. A fit that
    has `begun` goes on from there, with forces as they are, for `most` steps at most.
    """
    state = begun or State.of(problem, _forces(problem) if sigma is None else sigma)
    weighing = _Weighing.of(problem) if sigma is None and begun is None else None
    if weighing is not None:
        for _ in range(STEPS):
            if _stepped(problem, state, STIFF[0], ~problem.dynamic) < SETTLED:
                break
        for _ in range(STEPS):
            if weighing.weighed(problem, state) < KNOWN:
                break
            state.smooth(problem)
        _stepped(problem, state, STIFF[1], ~problem.dynamic)
    least, idle = np.inf, 0
    for _ in range(most):
        wrong = 0.0 if weighing is None else weighing.weighed(problem, state)
        length = _stepped(problem, state, STIFF[2])
        if wrong > KNOWN:
            continue
        idle = 0 if state.lowest < least - ARRIVED**2 else idle + 1
        least = min(least, state.lowest)
        if length < ARRIVED or state.reach == NEAR or idle == PATIENCE:
            break
    return state


def _stepped(problem: Problem, state: State, stiff: float, free: NDArray[np.bool_] | None = None) -> float:
    state.idealise(problem, stiff)
    state.adapt(problem)
    return step(problem, state, Quadratic.of(problem, state), free)


@dataclass(slots=True, eq=False)
class _Weighing:
    """How large forces are, found in steps: longer ones for as long as they go one way, shorter where they turn."""

    least: Array  # (forces,)
    reach: Array  # times a step of each's logarithm
    before: Array  # the step before

    @classmethod
    def of(cls, problem: Problem) -> _Weighing:
        least = LEAST * _forces(problem)
        return cls(least, np.ones(len(least)), np.zeros(len(least)))

    def weighed(self, problem: Problem, state: State) -> float:
        """Take a step towards what repeats differ by; return by how much of its logarithm one was wrong at most."""
        sigma = state.sigma[problem.forces]
        ratio = np.maximum(np.sqrt(powers(problem, state).noise[problem.forces]), self.least / sigma)
        self.reach *= np.where(np.log(ratio) * self.before < 0.0, *ONWARD)
        self.before = np.log(ratio)
        state.weigh(problem, sigma * np.clip(ratio ** np.minimum(self.reach, BEYOND), *CHANGE))
        return float(np.abs(np.log(np.clip(ratio, *CHANGE))).max())


def _forces(problem: Problem) -> Array:
    """Sigmas (forces,) to begin with: what a reading's noise is as a force."""
    force, torque = problem.sigma[:3].mean(), problem.sigma[3:6].mean()
    mass = sum(float(body.mass) for body in problem.rig.bodies)
    return WIDER * np.repeat([torque, OF_JOINT * torque, force / mass / SHAKEN], [3, problem.joints, 3])


def _found(problem: Problem, state: State, judge: _Judge | None) -> tuple[tuple[Proposal, ...], Fitted]:
    """Effects, one after the other, and the fit beside them.

    Each is the one that recordings of the fit and those held out together show most. Beside each that is found all
    numbers settle again. What comes again and no number takes up counts as noise until an effect explains it.
    """
    found: list[Proposal] = []
    forces, noise, most = problem.forces, state.sigma.copy(), 0.0
    while len(found) < MOST:
        excess = powers(problem, state).of_all
        state.sigma[forces] = (noise * np.sqrt(np.maximum(excess, 1.0)))[forces]
        screen = Screen(problem, state)
        taken = {_suspect(one) for one in problem.found}  # another shape of one is no second effect
        chosen = [one for one in screen.candidates() if _suspect(one) not in taken]
        leaders = [screen.refined(one) for one in _leading([screen.sized(one) for one in screen.scored(chosen)])]
        if judge is not None:
            held = judge.screen(state.sigma[forces])
            leaders = [told for one in leaders if (told := judge.confirmed(one, held))]
        leaders.sort(key=lambda one: -one.worth)
        if not leaders or leaders[0].worth < max(DETECTED, INEXACT * most):
            break
        state.sigma[forces] = noise[forces]
        most = max(most, leaders[0].worth)
        tried = Counter((one.name, one.site) for one in chosen)
        contenders = _contenders(leaders, screen)
        every = [_beside(problem, state, one, tried) for one, _ in contenders]
        first = min(every, key=lambda one: one.cost)
        best, problem, state = first.scored, first.problem, settled(first.problem, begun=first.state)
        alike = [
            told
            for fitted, (one, same) in zip(every, contenders, strict=True)
            if fitted.cost < first.cost + ALIKE
            for told in (one, *same)
        ]
        found.append(_proposal(best, leaders, alike))
        judge = None if judge is None else judge.joined(best.candidate, problem, state)
    return tuple(found), Fitted.of(problem, state)


def _contenders(leaders: Sequence[Scored], screen: Screen) -> list[tuple[Scored, list[Scored]]]:
    """The first, and those of other places or physics that are worth nearly as much; each with what does the same.

    No fit tells apart what does the same beside all numbers: of these the likeliest beforehand stands for all.
    """
    every: list[tuple[Scored, list[Scored]]] = []
    for one in leaders:
        if not one.worth > leaders[0].worth - max(ALIKE, INEXACT * leaders[0].worth):
            break
        if any(_suspect(one.candidate) == _suspect(first.candidate) for first, _ in every):
            continue
        same = next((own for first, own in every if screen.same(first, one)), None)
        if same is not None:
            same.append(one)
        elif len(every) < RIVALS:
            every.append((one, []))
    return [_likeliest([one, *same]) for one, same in every]


def _likeliest(alike: list[Scored]) -> tuple[Scored, list[Scored]]:
    """The likeliest, and the others."""
    first = max(alike, key=lambda one: one.likely)
    return first, [one for one in alike if one is not first]


@dataclass(frozen=True, slots=True, eq=False)
class _Beside:
    scored: Scored
    problem: Problem
    state: State
    cost: float  # twice the negative logarithm of its odds, less a constant


def _beside(problem: Problem, state: State, one: Scored, tried: Mapping[tuple[str, str], int]) -> _Beside:
    """All numbers as good as settled beside an effect and its shape; what was tried more often is less likely."""
    wider = problem.joined(one.candidate)
    begun = settled(wider, begun=state.joined(problem, wider), most=TRIED)
    for _ in range(RESHAPED):
        places = np.stack(wider.amplitudes)[:, -len(one.candidate.amplitudes) :]
        candidate = Screen(wider, begun).reshaped(one.candidate, places)
        if candidate == one.candidate:
            break
        one = replace(one, candidate=candidate)
        wider = problem.joined(candidate)
        begun = settled(wider, begun=replace(begun, reach=REACH, lowest=np.inf), most=TRIED)
    often = tried[one.candidate.name, one.candidate.site]
    return _Beside(one, wider, begun, begun.cost(wider) + 2.0 * float(np.log(often)) - one.likely)


def _leading(scored: Sequence[Scored]) -> list[Scored]:
    """The best shape of each law at each place, of the first few, and none that is worth far less than the first."""
    first: dict[tuple[str, str], Scored] = {}
    for one in sorted(scored, key=lambda one: -one.worth):
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
        _know(problem, fitted, state)
        own = settled(problem, state.sigma[problem.forces])
        counted = [sum(float(r.weight.sum()) for r in p.recordings) for p in (problem, fitted)]
        return cls(problem, own, counted[0] / counted[1])

    def joined(self, candidate: Candidate, fitted: Problem, state: State) -> _Judge:
        """The same with one effect more, and numbers as they are fitted beside it."""
        problem = self.problem.joined(candidate)
        _know(problem, fitted, state)
        begun = self.state.joined(self.problem, problem)
        common = problem.own[0].start
        begun.x[:common] = problem.prior[:common]
        begun.sigma[problem.forces] = state.sigma[problem.forces]
        return replace(self, problem=problem, state=settled(problem, begun=begun))

    def screen(self, forces: Array) -> Screen:
        """With forces of these sigmas."""
        self.state.sigma[self.problem.forces] = forces
        return Screen(self.problem, self.state)

    def confirmed(self, one: Scored, held: Screen) -> Scored | None:
        """An effect with what it takes there, if they show it as far as it shows there."""
        taken, foretold = held.foreseen(one)
        if one.candidate.effect.each_trial:
            shown = taken > SHARE * min(self.samples * one.gain, held.left)
        else:
            shown = foretold < ALIKE or taken > FORETOLD * foretold
        return replace(one, foreseen=taken) if shown else None


def _know(problem: Problem, fitted: Problem, state: State) -> None:
    """Common numbers are those that were fitted, as well as they are known by now; as if none knew of another."""
    common = problem.own[0].start
    known = Quadratic.of(fitted, state).sigma(fitted.spread)
    problem.prior[:common], problem.spread[:common] = state.x[:common], known[:common]


def _proposal(best: Scored, leaders: Sequence[Scored], alike: Sequence[Scored]) -> Proposal:
    """What is said of an effect, with the next best of other places or physics, and what is not told from it."""
    first: dict[object, Candidate] = {}
    for one in leaders:
        first.setdefault(_suspect(one.candidate), one.candidate)
    first.pop(_suspect(best.candidate), None)
    same = {_suspect(one.candidate) for one in alike}
    others, own = tuple(first.values()), best.candidate
    return Proposal(own, others, tuple(one for one in others if _suspect(one) in same))


def _suspect(candidate: Candidate) -> tuple[object, ...]:
    """Where it acts, and what physics it is."""
    law = candidate.effect
    beneath = not law.port.of_channel and law.port.beneath
    return law.port_word, "" if beneath else candidate.site, law.family
