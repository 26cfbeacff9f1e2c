"""From a law that passed the gate to the find that is told: its numbers, its rivals, what it explains."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from kbs_process.diagnosis.acceptance.gate import Gate
from kbs_process.diagnosis.acceptance.outcome import Alternative, Curve, Find, Location
from kbs_process.diagnosis.acceptance.rivals import distance
from kbs_process.diagnosis.experiments.jumps import jump
from kbs_process.diagnosis.experiments.thresholds import RIVALS, told_apart
from kbs_process.diagnosis.facts import Estimate, Identity, Place
from kbs_process.diagnosis.nominal.joint import Own, Standing
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.diagnosis.proposing.curves import CurveSuspect, along, basis
from kbs_process.diagnosis.proposing.tryout import identity, in_plant, port_label
from kbs_process.diagnosis.screening.ranges import swept
from kbs_process.diagnosis.screening.screen import Catalogued, Found, Screening, Suspect
from kbs_process.diagnosis.screening.signature import per_unit
from kbs_process.diagnosis.screening.suspects import POINT, Candidate, weighed
from kbs_process.plant.effect import ACTION, ACTIONS, UNNAMED, Effect
from kbs_process.plant.laws import CATALOGUE
from kbs_process.plant.laws.position.measured_law import Measured
from kbs_process.plant.sensing import Sensing
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array

_ELEMENTS = {f"point[{k}]": name for k, name in enumerate(POINT)}


@dataclass(frozen=True, slots=True, eq=False)
class Tried:
    """A leader after its refit."""

    found: Found
    standing: Standing
    gate: Gate
    screening: Screening  # that it led
    own: Own  # none, of a law that was taken off each recording
    leapt: bool = False  # whether better phases were looked for beside it


def find_of(
    tried: Sequence[Tried], chances: Array, before: Standing, place: Location | None, refused: Sequence[Identity] = ()
) -> Find:
    """The find of the first of some laws that passed, each right with a chance; `before` stood without it.

    Those that were `refused` in the plant are none that it cannot be told from, whatever the linear plant says of them.
    """
    taken = tried[0]
    suspect, own = taken.found.suspect, identity(taken.found.suspect)
    equivalent = _equivalents(suspect, taken.standing.known.experiment.rig)
    chance = float(chances[0]) / (1 + len(equivalent))
    alternatives = [replace(one, probability=chance) for one in equivalent]
    for index, other in enumerate(tried):
        if index and not other.found.suspect.each_trial and not suspect.each_trial:
            apart = distance(taken.standing.known, other.standing.known)
            near = apart < told_apart(taken.found.score.rho_eff)
            alternatives.append(Alternative(identity(other.found.suspect), float(chances[index]), apart, near, True))
    simulated = {one.found.suspect.family for one in tried}
    for found in taken.screening.candidates:
        if found.suspect.family in simulated or found.absorbed or len(alternatives) >= 5:
            continue
        if identity(found.suspect) in refused or (of_clock(suspect) and of_clock(found.suspect)):
            continue  # what a clock does to first order is nothing to compare with what one does at its size
        # Along the linear plant the distance is what the best leaves of the other's lack of gain.
        rho = float(np.sqrt(max(taken.found.score.gain - found.score.gain, 0.0)))
        alternatives.append(Alternative(identity(found.suspect), 0.0, rho, rho < RIVALS, False))
    if own.family != UNNAMED:
        chance, alternatives = _alike_likely(chance, alternatives)
    alternatives.sort(key=lambda other: (-other.probability, other.rho_delta))
    alike: tuple[str, ...] = ()
    if place is not None:
        named = port_label(suspect)
        alike = next((port.alike for port in place.test.ports if port.name == named), ())
    return Find(
        identity=own,
        named=own.family != UNNAMED,
        equation=_law(suspect).section("Equation"),
        reference=_law(suspect).reference,
        estimates=_estimates(taken, before),
        probability=chance,
        rho_eff=taken.found.score.rho_eff,
        kappa=taken.found.score.kappa,
        gate=taken.gate,
        alternatives=tuple(alternatives),
        ports_alike=alike,
        held_out_variance=explained_share(before.known, taken.standing.known),
        curve=_curve(suspect, taken, before) if own.family == UNNAMED else None,
    )


def _alike_likely(chance: float, others: Sequence[Alternative]) -> tuple[float, list[Alternative]]:
    """The chance of a law, and `others`, where laws of the catalogue that do the same in the plant are alike likely.

    Schwarz's criterion would tell them apart by how many numbers they have: so it does for formulas that are nature's.
    """
    alike = [one for one in others if one.refitted and one.indistinguishable and one.identity.family != UNNAMED]
    even = (chance + sum(one.probability for one in alike)) / (1 + len(alike))
    return even, [replace(one, probability=even) if one in alike else one for one in others]


def of_clock(suspect: Suspect) -> bool:
    return isinstance(suspect, Catalogued) and suspect.of_clock


def _equivalents(suspect: Suspect, rig: Rig) -> tuple[Alternative, ...]:
    """What looks the same whatever is recorded: a torque over the angle, the weight of a mass that moves with it."""
    if not (isinstance(suspect, CurveSuspect) and suspect.law.like_weight):
        return ()
    if not weighed(rig, rig.joint(suspect.joint)):
        return ()
    law = "weight over joint angle"
    weights = (one for one in CATALOGUE if one.of_weight)
    same = (Identity(Place(weight.port_word, suspect.joint), weight.family, law) for weight in weights)
    return tuple(Alternative(one, 0.0, 0.0, indistinguishable=True, refitted=False) for one in same)


def _law(suspect: Suspect) -> Effect | Sensing:
    if isinstance(suspect, CurveSuspect):
        return suspect.law.effect
    assert isinstance(suspect, Catalogued)
    return suspect.candidate.effect


def _period(candidate: Candidate) -> float:
    """After which what a law says repeats."""
    shape = dict(candidate.shape)
    (period,) = (shape[entry.name] for entry in candidate.effect.parameters if entry.proposed == "period")
    return period


def _estimates(taken: Tried, before: Standing) -> tuple[Estimate, ...]:
    suspect, known = taken.found.suspect, taken.standing.known
    begin = len(before.known.value)
    units = {f"{name}{action}": "m" for name in POINT for action in ("", *(f"_{k}" for k in range(2, ACTIONS + 1)))}
    fixed: dict[str, float] = {}
    if isinstance(suspect, Catalogued):
        for action in suspect.candidate.actions:
            units |= {entry.name: entry.unit for entry in action.effect.parameters}
            fixed |= dict(action.shape)
    if suspect.each_trial:
        spread = np.sqrt(np.diag(taken.found.score.covariance))
        names, told = suspect.amplitudes, taken.found.score.amplitude
        # Those of the first recording that is fitted and no calibration, whose motion is another.
        roles = [known.experiment.trials[k].role for k in known.experiment.fit]
        own = slice(len(names) * next((i for i, role in enumerate(roles) if role != "calibration"), 0), None)
        fitted = [
            Estimate(name, units.get(name, ""), float(value), float(sigma))
            for name, value, sigma in zip(names, told[own], spread[own], strict=False)
        ]
        fitted += _drops(suspect)
    else:
        fitted = []
        for scalar, value, sigma in zip(
            known.free[begin:], map(float, known.value[begin:]), map(float, known.sigma[begin:]), strict=True
        ):
            name = _short(scalar.name, in_plant(suspect))
            # A law of the readings is fitted about the shape that the screen gave it.
            plain = name if in_plant(suspect) or name in units else re.sub(r"_\d+$", "", name)
            about = 0.0 if in_plant(suspect) else fixed.pop(plain, 0.0)
            fitted.append(Estimate(name, units.get(plain, ""), about + value, sigma, about))
    done = {one.name for one in fitted}
    return (*fitted, *(Estimate(n, units.get(n, ""), v, 0.0) for n, v in fixed.items() if n not in done))


def _drops(suspect: Suspect) -> list[Estimate]:
    """When a clock seems to jump, along each trajectory that is fitted; nothing of another law."""
    if not (isinstance(suspect, Catalogued) and suspect.jumps):
        return []
    experiment, shown, stream = suspect.scene.experiment, suspect.scene.predicted, suspect.candidate.site
    first = {experiment.trials[k].trajectory: experiment.trials[k].name for k in reversed(experiment.fit)}
    return [
        Estimate(f"drop_time {name}", "s", jump(experiment, shown, trajectory, stream), 0.0)
        for trajectory, name in sorted(first.items())
    ]


def _short(name: str, plant: bool) -> str:
    path, _, short = name.rpartition(".") if plant or "." in name else ("", "", name)
    if short not in _ELEMENTS:
        return short
    # A second action of a force has numbered amplitudes; its point is told likewise.
    action = re.search(f"{ACTION}$", path)
    return _ELEMENTS[short] + (action[0] if action else "")


def explained_share(before: Known, after: Known, beyond: float = 0.0) -> float | None:
    """Share of the held-out residual's excess over the floor, `beyond` a part of it, that a law takes away."""
    chosen = before.experiment.held_out
    if not chosen:
        return None
    excess = sum(float(before.chi2[k] - (1.0 + beyond) * before.rows[k]) for k in chosen)
    gained = sum(float(before.chi2[k] - after.chi2[k]) for k in chosen)
    return float(min(1.0, gained / excess)) if excess > 0.0 else None


def _curve(suspect: Suspect, taken: Tried, before: Standing) -> Curve:
    """A measured law over what its regressor sweeps, of what comes again over one period of it."""
    law: Measured | Sensing
    if isinstance(suspect, CurveSuspect):
        law, x = suspect.law, along(suspect.law, *suspect.ends)
        columns = basis(law, x, float(x[0]), float(x[-1]))
    else:
        assert isinstance(suspect, Catalogued) and isinstance(suspect.candidate.effect, Sensing)
        law = suspect.candidate.effect
        low, high = swept(suspect.scene).spans[suspect.candidate.site, "reading"]
        x = np.linspace(low, min(high, low + _period(suspect.candidate)), 101)
        columns = per_unit(suspect.candidate, np.arange(101.0), x, {})
        columns = columns - columns.mean(axis=0)  # an offset is the encoder's, and of another size
    known = taken.standing.known
    return _drawn(law, x, columns, known, range(len(before.known.value), len(known.value)))


def _drawn(law: Measured | Sensing, x: Array, columns: Array, known: Known, own: Sequence[int]) -> Curve:
    """The curve whose coefficients are some numbers, `own`, over x."""
    index = np.asarray(own)
    C = known.covariance[np.ix_(index, index)]
    spread = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", columns, C, columns), 0.0))
    return Curve(law, x, columns, columns @ known.value[index], spread)


def as_it_stands(find: Find, law: Own, known: Known) -> Find:
    """A find with its law's numbers as they are after all others were found."""
    own = [known.names.index(name) for name in law.names]
    fitted = [
        replace(one, value=one.about + float(known.value[k]), sigma=float(known.sigma[k]))
        for one, k in zip(find.estimates, own, strict=False)
    ]
    curve = find.curve and _drawn(find.curve.law, find.curve.x, find.curve.columns, known, own)
    return replace(find, estimates=(*fitted, *find.estimates[len(own) :]), curve=curve)


def merged(finds: Sequence[Find]) -> tuple[Find, ...]:
    """Finds of one law at one place are one: harmonics of an order, or a law and what its formula lacks."""
    merged: list[Find] = []
    for find in finds:
        place = next((k for k, other in enumerate(merged) if other.identity == find.identity), None)
        if place is None:
            merged.append(find)
            continue
        first = merged[place]
        folds = tuple(
            replace(one, after=other.after, gain=one.gain + other.gain)
            for one, other in zip(first.gate.folds, find.gate.folds, strict=True)
        )
        white = first.gate.whiteness[0], find.gate.whiteness[1]
        merged[place] = replace(
            first,
            estimates=(*first.estimates, *find.estimates),
            parts=(*first.actions, find.estimates),
            gate=replace(first.gate, folds=folds, whiteness=white),
            rho_eff=float(np.hypot(first.rho_eff, find.rho_eff)),
        )
    return tuple(merged)


def trusted(finds: Sequence[Find], share: float) -> tuple[Find, ...]:
    """Finds with their chances and their rivals' times the share of such finds that were right; the rest is unknown.

    The odds are those of some laws of which one is right, and nature's may be none of them.
    """
    return tuple(
        replace(
            find,
            probability=share * find.probability,
            alternatives=tuple(replace(other, probability=share * other.probability) for other in find.alternatives),
        )
        for find in finds
    )
