"""A find as a suspect again: on other trajectories than those that showed it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from kbs_process.diagnosis.acceptance.outcome import Find
from kbs_process.diagnosis.facts import Estimate
from kbs_process.diagnosis.proposing.curves import CurveSuspect, basis
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.diagnosis.screening.screen import Catalogued, Suspect
from kbs_process.diagnosis.screening.suspects import POINT, Candidate, Point
from kbs_process.plant.effect import ACTION, ACTIONS, Effect, Port, instance
from kbs_process.plant.laws import LAWS
from kbs_process.plant.laws.position.measured_law import Measured
from kbs_process.plant.sensing import BY, Sensing
from kbs_process.rig.model import TRANSDUCER
from kbs_process.signals.records import Array


def suspect_of(find: Find, scene: Scene) -> tuple[Suspect, Array] | None:
    """Return a find as a suspect of a scene, with its amplitudes; None for what is each recording's own."""
    own = find.identity
    if find.curve is not None and isinstance(find.curve.law, Measured):
        over, x = find.curve.law, find.curve.x
        ends = float(x[0]), float(x[-1])
        coefficients = np.linalg.lstsq(basis(over, x, *ends), find.curve.value, rcond=None)[0]
        return CurveSuspect(scene, over, own.place.site, ends), np.asarray(coefficients)
    law = LAWS.get(own.law)
    mounting = law is not None and law.port is Port.BASE_TORQUE
    site = TRANSDUCER if mounting else BY.join(own.place.channels) or own.place.site
    if law is None or law.each_trial or not site:
        return None
    # Of a sensor's law that was found more than once, the action that was found first.
    numbers = _numbers(find.estimates if law.in_plant else find.actions[0])
    if not _tells(numbers, law):
        return None
    if "temperature" in law.arguments and any(one.temperature is None for one in scene.experiment.trials):
        return None
    candidate = Candidate(law, site, _shape(law, numbers), _point(numbers), _again(law, site, find))
    sizes = np.array([numbers[e.name].value for e in candidate.amplitudes])
    told = Catalogued(candidate, scene)
    return replace(told, size=float(sizes[0])) if told.of_clock else told, sizes


def _again(law: Effect | Sensing, site: str, find: Find) -> tuple[Candidate, ...]:
    """Further actions of a law whose numbers a find has, too: other orders."""
    if not isinstance(law, Effect) or not law.port.of_drive:
        return ()
    numbers = {one.name: one for one in find.estimates}
    actions = (instance(law, number) for number in range(2, ACTIONS + 1))
    told = [action for action in (law, *actions) if _tells(numbers, action)][1:]  # the first has the law's names
    return tuple(Candidate(action, site, _shape(action, numbers)) for action in told)


def _tells(numbers: Mapping[str, Estimate], law: Effect | Sensing) -> bool:
    """Whether a law's numbers are all among some."""
    return all(entry.name in numbers for entry in law.parameters if entry.role != "shared")


def _shape(law: Effect | Sensing, numbers: Mapping[str, Estimate]) -> tuple[tuple[str, float], ...]:
    return tuple((e.name, numbers[e.name].value) for e in law.parameters if e.role == "shape")


def _numbers(estimates: Sequence[Estimate]) -> dict[str, Estimate]:
    """Estimates by their names, and those of the first action by the law's, whichever action this is."""
    own = {one.name: one for one in estimates}
    return {re.sub(f"{ACTION}$", "", name): own[name] for name in reversed(own)} | own


def _point(numbers: Mapping[str, Estimate]) -> Point | None:
    """Where a force acts, if that was fitted."""
    if not all(name in numbers for name in POINT):
        return None
    x, y, z = (numbers[name].value for name in POINT)
    return x, y, z


def sigma_of(find: Find, suspect: Suspect, amplitude: Array) -> Array:
    """Return the amplitudes' present standard deviations (m,); of a curve its band, at the coefficients' nodes."""
    if find.curve is not None and isinstance(find.curve.law, Measured):
        nodes = np.linspace(0.0, len(find.curve.x) - 1.0, len(amplitude)).round().astype(int)
        return np.asarray(find.curve.sigma[nodes])
    numbers = _numbers(find.estimates if LAWS[find.identity.law].in_plant else find.actions[0])
    return np.array([numbers[name].sigma for name in suspect.amplitudes])
