"""How a suspect gets into the plant, or onto its prediction, with numbers to begin with."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from kbs_process.diagnosis.experiments.hypothesis import Hypothesis
from kbs_process.diagnosis.facts import Identity, Place
from kbs_process.diagnosis.nominal.joint import Extra, Standing
from kbs_process.diagnosis.proposing import measured
from kbs_process.diagnosis.proposing.curves import CurveSuspect
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.diagnosis.screening.screen import Bench, Catalogued, Found, Suspect
from kbs_process.diagnosis.screening.shapes import Bend, along, bends
from kbs_process.diagnosis.screening.suspects import Candidate, point_of
from kbs_process.identification.output_error import Scalar
from kbs_process.plant.attach import attach
from kbs_process.plant.effect import UNNAMED, Effect
from kbs_process.plant.laws import select
from kbs_process.plant.sensing import BY
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array

_WHOLE_CYCLES = 1e-3  # from a whole number of them: less than lines of a residual are apart


def identity(suspect: Suspect) -> Identity:
    """In the field's words."""
    if isinstance(suspect, CurveSuspect):
        return Identity(Place(suspect.law.effect.port_word, suspect.joint), UNNAMED, suspect.law.words)
    assert isinstance(suspect, Catalogued)
    candidate, law = suspect.candidate, suspect.candidate.effect
    channels = tuple(candidate.site.split(BY)) if law.port.of_channel else ()
    axis = "" if law.port.of_channel or law.port.beneath else candidate.site
    own = law.of_cycles if _with_cycles(candidate, suspect.scene.hypothesis.rig) else law.family
    return Identity(Place(law.port_word, axis, channels), own, candidate.name)


def _with_cycles(candidate: Candidate, rig: Rig) -> bool:
    """Whether orders of a motor all come with whole electrical cycles of it: then its own poles and teeth make them."""
    if not candidate.effect.of_cycles:
        return False
    drive = rig.joint(candidate.site).drive
    if drive is None or "Kangle" not in drive.parameters:
        return False
    orders = np.array([action.shape[0][1] for action in candidate.actions])
    cycles = orders / float(drive.parameters["Kangle"])
    whole = np.rint(cycles)
    return bool(np.all((whole > 0.0) & (np.abs(cycles - whole) < _WHOLE_CYCLES)))


def port_label(suspect: Suspect) -> str:
    """The port of the port test at which a suspect acts: more exact than the word for it."""
    if isinstance(suspect, CurveSuspect):
        return Place(suspect.port.replace("_", " "), suspect.joint).label
    assert isinstance(suspect, Catalogued)
    candidate, own = suspect.candidate, identity(suspect).place
    if candidate.port.tested:
        return Place(candidate.port.tested, own.site).label
    return Place(own.port, own.site, own.channels[:1]).label


def in_plant(suspect: Suspect) -> bool:
    """Whether it is simulated in the non-linear plant."""
    if isinstance(suspect, CurveSuspect):
        return True
    return isinstance(suspect, Catalogued) and suspect.candidate.effect.in_plant and not suspect.each_trial


def of_every_clock(found: Found) -> bool:
    """Whether it is the error of a clock, the same in all recordings."""
    return isinstance(found.suspect, Catalogued) and found.suspect.of_every_clock


def extra_of(found: Found, standing: Standing, bench: Bench, scene: Scene) -> Extra:
    """The suspect at the screen's amplitudes, of which its bounds are all that is known.

    So wide a prior changes nothing that recordings show, and holds what they do not: the torque of a cable in its
    middle, where a transducer's zero is fitted. The point of a force `anywhere` has none.
    """
    suspect, amplitude = found.suspect, found.score.amplitude
    if not in_plant(suspect):
        tag = ".".join(suspect.family)
        first = re.escape(f"law.{tag}.{suspect.amplitudes[0]}")
        used = sum(re.fullmatch(rf"{first}(_\d+)?", name) is not None for name in standing.laws)
        if isinstance(suspect, Catalogued) and suspect.of_clock:
            suspect = replace(suspect, size=float(amplitude[0]))
        drives = sorted(_references(standing))
        columns = {drive: bench.signatures([suspect], drive) for drive in drives}
        shaped: tuple[Bend, ...] = ()
        if isinstance(suspect, Catalogued) and (bent := bends(suspect.candidate, standing.hypothesis.rig)):
            # How far shapes are from where the screen has them, to first order: zero to begin with.
            shaped = bent
            columns = {d: np.dstack([x, along(bench, suspect, amplitude, d)]) for d, x in columns.items()}
        names = (*suspect.amplitudes, *(one.name for one in shaped))
        start = np.concatenate([amplitude, np.zeros(len(shaped))])
        free = np.full(len(amplitude), np.inf)
        wide = _widths(suspect) if isinstance(suspect, Catalogued) else free
        sizes = [one.size for one in shaped]
        return Extra(
            hypothesis=standing.hypothesis,
            plant=(),
            start=start,
            prior=0.0 * start,
            sigma=np.concatenate([wide, [one.sigma for one in shaped]]),
            scale=np.concatenate([np.abs(amplitude), sizes]),
            lower=np.concatenate([-free, [one.low - one.value for one in shaped]]),
            upper=np.concatenate([free, [one.high - one.value for one in shaped]]),
            linear=tuple(Scalar(f"law.{tag}.{name}{f'_{used + 1}' if used else ''}") for name in names),
            columns={drive: np.moveaxis(x, 2, 0) for drive, x in columns.items()},
        )
    if isinstance(suspect, CurveSuspect):
        return measured.extra(suspect, found.score, standing)
    assert isinstance(suspect, Catalogued) and isinstance(suspect.candidate.effect, Effect)
    candidate, effect = suspect.candidate, suspect.candidate.effect
    present = standing.hypothesis
    hypothesis = inserted(candidate, dict(zip(suspect.amplitudes, map(float, amplitude), strict=True)), present)
    path = f"joint.{candidate.site}.drive" if effect.port.of_drive else f"external.{effect.name}"
    shaped = bends(candidate, present.rig)
    size = np.sqrt(np.maximum(np.diag(found.score.covariance), 0.0))
    begin = np.array([one.value for one in shaped])
    any_size = np.full(len(amplitude), np.inf)
    # An amplitude that has one sign keeps it.
    least = np.array([0.0 if entry.bounds[0] >= 0.0 else -np.inf for entry in candidate.amplitudes])
    return Extra(
        hypothesis=hypothesis,
        plant=(*(Scalar(f"{path}.{name}") for name in suspect.amplitudes), *(one.scalar(path) for one in shaped)),
        start=np.concatenate([amplitude, begin]),
        prior=np.concatenate([0.0 * amplitude, begin]),
        sigma=np.concatenate([_widths(suspect), [one.sigma for one in shaped]]),
        scale=np.concatenate([np.maximum(np.abs(amplitude), 5.0 * size), [one.size for one in shaped]]),
        lower=np.concatenate([least, [one.low for one in shaped]]),
        upper=np.concatenate([any_size, [one.high for one in shaped]]),
    )


def inserted(candidate: Candidate, amplitudes: Mapping[str, float], hypothesis: Hypothesis) -> Hypothesis:
    """Return a hypothesis with a law of the catalogue in its plant, each of its actions with its own numbers."""
    rig, names = hypothesis.rig, [*hypothesis.effects]
    for action in candidate.actions:
        effect = action.effect
        assert isinstance(effect, Effect)
        values = dict(action.shape) | {entry.name: amplitudes[entry.name] for entry in action.amplitudes}
        if effect.port.of_drive:
            rig = attach(rig, effect, values, joints=[action.site])
        else:
            point = point_of(rig, action.site) if action.point is None else np.array(action.point)
            rig = attach(rig, effect, values, on=action.site, point=point)
        names.append(effect.name)
    return Hypothesis(rig, tuple(one.name for one in select([*dict.fromkeys(names)])))


def _widths(suspect: Catalogued) -> Array:
    """(m,) how large amplitudes may be."""
    bounds = np.array([entry.bounds for entry in suspect.candidate.amplitudes])
    return np.asarray(np.abs(bounds).max(axis=1), dtype=np.float64)


def _references(standing: Standing) -> set[int]:
    experiment = standing.known.experiment
    return {experiment.reference(k) for k in range(len(experiment.repeats))}
