"""From a starting point to a minimum: descents with renewed slopes, and jumps to where a descent does not lead."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kbs_process.estimation.descent import descend
from kbs_process.estimation.fit import Parameters, triangle
from kbs_process.identification.contact import edge_minima
from kbs_process.identification.objective import Objective, first_differences, settled
from kbs_process.identification.output_error import Experiment, Spectra
from kbs_process.identification.polar import Polar
from kbs_process.identification.screening import Evaluate, Start, contacts, phases
from kbs_process.identification.unknowns import prior, with_factors
from kbs_process.signals.records import Array

BETTER = 10.0  # of -2 log likelihood: a phase or an edge is moved for more
_CALM = 0.9  # weight from which a search is near its end
_STEPS = 6  # with the same slopes
_TRUSTED = 1.0  # prior sigmas: how far numbers go with the same slopes
_LEAPS = 2  # every how many rounds other phases and edges are looked at
_TURNS = 4  # phases that are tried of an effect that is smooth in it
EDGES = 4  # pairs of edges that are tried of a contact
_FOLLOWED = 2  # Gauss-Newton steps of each in its own numbers, before it is judged


@dataclass(frozen=True, slots=True, eq=False)
class Mode:
    """Where one start led."""

    start: Start
    values: Array
    cost: float  # -2 log posterior, less a constant
    triangle: Array  # (p, p) R of the slopes of the residual by the free numbers there
    settled: bool  # no other phase or contact edge was better, and the last step gained next to nothing


def follow(
    experiment: Experiment,
    start: Start,
    values: Array,
    spectra: Sequence[Spectra],
    evaluate: Evaluate,
    columns: Mapping[int, list[Array]],
    *,
    gears: int,
    run_to_run: float,
    rounds: int,
    gain: float,
) -> Mode:
    """Follow one start. While much is unexplained, residuals count for less, so that no step is rash."""
    parameters = with_factors(prior(experiment), experiment, run_to_run)
    theta = np.concatenate([values, np.zeros(len(parameters.value) - len(values))])
    objective = Objective(
        experiment, spectra, evaluate, first_differences(prior(experiment)), gears, central=False, columns=columns
    )
    polar = Polar.of(phases(experiment.rig, experiment.effects, experiment.free), parameters)
    searched = arrived = False
    for number in range(1, rounds + 1):
        weight = 1.0 / max(1.0, float(np.sqrt(np.mean(objective.residual(theta) ** 2))))

        def misfit(u: Array, weight: float = weight) -> Array:
            at = polar.back(u)
            return np.concatenate([weight * objective.residual(at), polar.excess(at)])

        J = polar.jacobian(weight * objective.jacobian(theta), theta)
        u = polar.flat(theta)
        down = descend(misfit, J, _near(polar.flat_parameters, u), u, gain=gain, steps=_STEPS)
        theta = polar.back(down.value)
        objective.differences = settled(objective.columns, prior(experiment))
        arrived = weight > _CALM and down.gained < gain
        if not searched and (arrived or number % _LEAPS == 0):
            moved = leap(objective, theta, parameters)
            stays = np.array_equal(moved, theta)
            searched = stays and weight > _CALM
            if not stays:
                objective.columns.clear()  # the others' were those of a plant further off
            theta = moved
        if arrived and searched:
            break
    if not objective.columns:
        objective.difference(theta)  # the last round leapt
    r = objective.residual(theta)
    excess = (theta - parameters.value) / parameters.sigma
    R = triangle(objective.assembled(theta)[:, : len(experiment.free)])
    return Mode(start, theta, float(r @ r + excess @ excess), R, arrived and searched)


def _near(parameters: Parameters, u: Array) -> Parameters:
    """Bounds within which slopes taken at u (p,) are believed: a prior's sigma, an amplitude, half a radian of contact.

    Farther out friction may turn abrupt, and a mechanism whose friction chatters has no slopes to lead back.
    """
    reach = _TRUSTED * np.where(np.isfinite(parameters.sigma) | (parameters.value != 0.0), parameters.scale, 0.5)
    return replace(
        parameters,
        lower=np.maximum(parameters.lower, np.minimum(u - reach, parameters.upper)),
        upper=np.minimum(parameters.upper, np.maximum(u + reach, parameters.lower)),
    )


def leap(objective: Objective, theta: Array, parameters: Parameters) -> Array:
    """Return `theta` with phases and contact edges moved to a better minimum, where there is one.

    What a weak effect does shows only once the strong ones are right. Each phase that enters smoothly is tried around
    the turn with its amplitude's prior, each contact at its best pairs of edges, once these have settled; all other
    numbers follow as the linear model has it.
    """
    experiment = objective.experiment
    J = objective.assembled(theta)
    best = theta.copy()
    for pair in phases(experiment.rig, experiment.effects, experiment.free):
        if not pair.smooth:
            continue
        trials = []
        for turn in np.arange(_TURNS) * (2.0 * np.pi / _TURNS):
            trial = theta.copy()
            trial[[pair.phase, pair.amplitude]] = turn, parameters.value[pair.amplitude]
            trials.append(trial)
        best += _gained(objective, theta, trials, [pair.phase, pair.amplitude], J, parameters)
    for contact in contacts(experiment.rig, experiment.effects, experiment.free):
        trials = edge_minima(objective.residuals, theta, J, parameters, contact, EDGES)
        own = [contact.torque, contact.width, contact.phase]
        trials = _followed(objective, trials, own, J, parameters)
        best += _gained(objective, theta, trials, own, J, parameters)
    return parameters.clipped(best)


def _followed(
    objective: Objective, trials: Sequence[Array], own: list[int], J: Array, parameters: Parameters
) -> list[Array]:
    """Move each of `trials` by Gauss-Newton steps in its `own` numbers, with slopes of its own; the rest as in J.

    Places come from a grid of edges that is far coarser than what a contact is known to: half a step of it may cost as
    much as a minimum elsewhere.
    """
    weights = 1.0 / parameters.sigma
    scale = parameters.scale[own]
    points = list(trials)
    for _ in range(_FOLLOWED):
        moved = [at.copy() for at in points]
        beside = []
        for at in points:
            for index in own:
                one = at.copy()
                one[index] += objective.differences[index]
                beside.append(one)
        found = objective.residuals([*points, *beside])
        for k, (at, r) in enumerate(zip(points, found, strict=False)):
            slopes = J.copy()
            for place, index in enumerate(own):
                column = found[len(points) + k * len(own) + place]
                slopes[:, index] = (column - r) / objective.differences[index]
            gradient = slopes.T @ r + (at - parameters.value) * weights**2
            step = -np.linalg.solve(slopes.T @ slopes + np.diag(weights**2), gradient)[own]
            moved[k][own] += np.clip(step, -_TRUSTED * scale, _TRUSTED * scale)
        points = [parameters.clipped(at) for at in moved]
    return points


def _gained(
    objective: Objective, theta: Array, trials: Sequence[Array], own: list[int], J: Array, parameters: Parameters
) -> Array:
    """Move from `theta` to the best of `trials`, which differ in their `own` numbers, or none; the rest follows."""
    rest = np.delete(np.arange(len(theta)), own)
    weights = 1.0 / parameters.sigma
    slopes = np.vstack([J[:, rest], np.diag(weights)[:, rest]])
    normal = slopes.T @ slopes
    costs, moves = [], []
    points = [theta, *trials]
    for at, r in zip(points, objective.residuals(points), strict=True):
        left = np.concatenate([r, (at - parameters.value) * weights])
        along = slopes.T @ left
        moves.append(-np.linalg.solve(normal, along))
        costs.append(float(left @ left + along @ moves[-1]))
    chosen = int(np.argmin(costs))
    move = np.zeros_like(theta)
    if costs[chosen] < costs[0] - BETTER:
        move[own] = (points[chosen] - theta)[own]
        reach = _TRUSTED * parameters.scale[rest]
        move[rest] = np.clip(moves[chosen] - moves[0], -reach, reach)
    return move
