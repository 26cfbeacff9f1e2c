"""Identification of the plant's numbers from recordings: starts, search, refinement, uncertainty.

Free are the motor-gears' parameters and the transducer's stiffness and damping, and with them every other number of
the rig that has an uncertainty and shows in these recordings (inertias, CoGs, the amplifier's corner, ...): these are
fitted within their priors, so that what they are not known by counts in all that is. Friction differs from run to
run: each friction torque has a factor for each recording, 1 within `Settings.run_to_run`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace

import numpy as np

from kbs_process.estimation.fit import Fit, Parameters, Residual, fit_map
from kbs_process.estimation.profile import Profile, profiles
from kbs_process.plant.effect import Port, Uniform
from kbs_process.plant.effects import select
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array
from kbs_process.stages.output_error import (
    Experiment,
    Scalar,
    Spectra,
    estimated_spectra,
    sensor_spectra,
    unexplained,
)
from kbs_process.stages.polar import Polar
from kbs_process.stages.screening import Evaluate, Start, match_resonances, phases, starts

_DIFFERENCE = 0.05  # prior sigmas (phases: rad), first difference
_SEEN = 5.0  # what a difference should move the whitened residual by: above its jumps where friction sticks
_LEAST_DIFFERENCE, _MOST_DIFFERENCE = 2e-3, 0.4  # prior sigmas
_BETTER = 10.0  # of -2 log likelihood: a phase is moved for more
_CALM = 0.9  # weight from which a search is near its end
_ROUGH = 10.0  # what ends a search, over what ends a refinement
_REPHASED = 2  # every how many rounds weak effects' phases are looked for again
_NOT_MOVING = ("spacecraft.", "controller.", "transducer.noise", "transducer.resolution", "transducer.bias")
_PROJECTED = ("transducer.cross_coupling",)
_NO_EFFECT = ("steps_per_turn", "encoder.offset", "gravity.magnitude")
# The paper's five, by the parameters that describe them.
CRITICAL = ("Ts0", "delta", "phi_stat", "Ka", "fsv", "tcog", "phi_cog", "d1", "phi_dyn")


@dataclass(frozen=True, slots=True)
class Settings:
    """What the identification takes for granted."""

    run_to_run: float = 0.02  # standard deviation of a friction torque from run to run, of itself
    starts: int = 2  # that are followed
    screening_lowest_Hz: float = 0.5  # above what masses and CoGs do
    lowest_Hz: float = 0.05
    negligible: float = 0.1  # a number of the rig that moves all residuals by less, at one sigma, is fixed
    rounds: int = 8  # of a search, two steps each
    iterations: int = 8  # of a refinement
    gain: float = 1.0  # of -2 log likelihood: a step that promises less ends a search


@dataclass(frozen=True, slots=True, eq=False)
class Mode:
    """Where one start led."""

    start: Start
    values: Array
    cost: float  # -2 log posterior, less a constant
    differences: Array  # (p,) by which slopes are best taken there


@dataclass(frozen=True, slots=True, eq=False)
class Identification:
    """The estimate and everything a reader may ask of it."""

    experiment: Experiment  # its `free` are the numbers below
    fit: Fit  # free numbers, then run-to-run factors
    jacobian: Array  # (n, p) of the whitened residual there
    spectra: tuple[Spectra, ...]
    modes: tuple[Mode, ...]
    parameters: Parameters

    @property
    def values(self) -> Array:
        """(p,) of the free numbers."""
        return self.fit.value[: len(self.experiment.free)]

    @property
    def rig(self) -> Rig:
        return self.experiment.rig_at(self.values)


def gearbox(rig: Rig, effects: Sequence[str]) -> tuple[Scalar, ...]:
    """What is to be identified: the drives' uncertain parameters, the transducer's stiffness and damping."""
    quantities = rig.quantities()
    found = []
    for joint in rig.joints:
        for effect in select(effects):
            for parameter in effect.parameters:
                name = f"joint.{joint.name}.drive.{parameter.name}"
                if quantities[name].sigma > 0.0 or isinstance(parameter.prior, Uniform):
                    found.append(Scalar(name))
    for name in ("transducer.stiffness", "transducer.damping"):
        if name in quantities:
            found += [Scalar(name, (axis,)) for axis in range(3) if quantities[name].sigma[axis] > 0.0]
    return tuple(found)


def others(rig: Rig, known: Sequence[Scalar]) -> tuple[Scalar, ...]:
    """Every other uncertain number of the rig that can move the residual."""
    taken = {scalar.name for scalar in known}
    return tuple(
        scalar
        for name, quantity in rig.quantities().items()
        if not name.startswith((*_NOT_MOVING, *_PROJECTED)) and not name.endswith(_NO_EFFECT)
        for element in np.ndindex(quantity.shape)
        if quantity.sigma[element] > 0.0 and (scalar := Scalar(name, element)).name not in taken
    )


def prior(experiment: Experiment) -> Parameters:
    """Means and sigmas of the parameter files; phases have none, and no bounds either: a turn brings them back."""
    quantities = experiment.rig.quantities()
    declared = {
        f"joint.{joint.name}.drive.{parameter.name}": parameter
        for joint in experiment.rig.joints
        for effect in select(experiment.effects)
        for parameter in effect.parameters
    }
    sigma, lower, upper = [], [], []
    for scalar in experiment.free:
        parameter = declared.get(scalar.name)
        phase = parameter is not None and isinstance(parameter.prior, Uniform)
        low, high = (-np.inf, np.inf) if parameter is None or phase else parameter.bounds
        if scalar.quantity in ("transducer.stiffness", "transducer.damping"):
            low = 0.0
        sigma.append(np.inf if phase else float(quantities[scalar.quantity].sigma[scalar.element]))
        lower.append(low)
        upper.append(high)
    names = tuple(scalar.name for scalar in experiment.free)
    return Parameters(names, experiment.nominal, np.array(sigma), np.array(lower), np.array(upper))


def frictions(experiment: Experiment) -> tuple[int, ...]:
    """Indices of the free numbers that are friction torques: those of passive effects on the rotor."""
    torques = {
        f"joint.{joint.name}.drive.{parameter.name}"
        for joint in experiment.rig.joints
        for effect in select(experiment.effects)
        if effect.passive and effect.port in (Port.MOTOR_TORQUE, Port.MOTOR_FRICTION)
        for parameter in effect.parameters
        if parameter.unit.startswith("N m")
    }
    return tuple(index for index, scalar in enumerate(experiment.free) if scalar.name in torques)


Evaluators = Callable[[Experiment], Evaluate]  # makes what evaluates the residuals of an experiment
Say = Callable[[str], AbstractContextManager[object]]  # opens a piece of work that is told to a user


class Objective:
    """Whitened residual and its Jacobian over all recordings; theta is free numbers, then run-to-run factors less 1.

    Columns of numbers from `gears` on, which hardly move from their priors, are differenced once and kept; the others
    at every point. To both sides if `central`.
    """

    def __init__(
        self,
        experiment: Experiment,
        spectra: Sequence[Spectra],
        evaluate: Evaluate,
        differences: Array,
        gears: int,
        *,
        central: bool,
        columns: Mapping[int, list[Array]] | None = None,
    ) -> None:
        self.experiment, self.spectra, self.gears, self.central = experiment, spectra, gears, central
        self.evaluate = evaluate
        self.differences = differences
        self.columns = dict(columns or {})
        self.scaled = frictions(experiment)
        self._last: tuple[bytes, list[Array]] = (b"", [])
        self._sloped = b""  # where the columns were taken

    def in_recordings(self, theta: Array) -> list[Array]:
        """Free numbers as each recording has them."""
        p = len(self.experiment.free)
        if len(theta) == p:  # as in all of them
            return [theta] * len(self.experiment.recordings)
        factors = 1.0 + theta[p:].reshape(len(self.experiment.recordings), len(self.scaled))
        found = []
        for row in factors:
            values = theta[:p].copy()
            values[list(self.scaled)] *= row
            found.append(values)
        return found

    def parts(self, theta: Array) -> list[Array]:
        """Residual of each recording."""
        key = theta.tobytes()
        if key != self._last[0]:
            tasks = [(r, v, self.spectra[r]) for r, v in enumerate(self.in_recordings(theta))]
            self._last = (key, self.evaluate(tasks))
        return self._last[1]

    def residual(self, theta: Array) -> Array:
        """(n,) of all recordings."""
        return np.concatenate(self.parts(theta))

    def residuals(self, thetas: Sequence[Array]) -> list[Array]:
        """The same at many points, evaluated together."""
        tasks = [
            (r, values, self.spectra[r])
            for theta in thetas
            for r, values in enumerate(self.in_recordings(theta))
        ]
        found, count = self.evaluate(tasks), len(self.experiment.recordings)
        return [np.concatenate(found[k : k + count]) for k in range(0, len(found), count)]

    def jacobian(self, theta: Array) -> Array:
        """(n, p + factors)."""
        self.difference(theta)
        return self.assembled(theta)

    def difference(self, theta: Array) -> None:
        """Bring the columns that are due to `theta`."""
        if theta.tobytes() == self._sloped and len(self.columns) == len(self.experiment.free):
            return
        self._sloped = theta.tobytes()
        base = self.in_recordings(theta)
        due = [i for i in range(len(self.experiment.free)) if i < self.gears or i not in self.columns]
        sides = (1.0, -1.0) if self.central else (1.0,)
        tasks = [(r, values, self.spectra[r]) for r, values in enumerate(base)]
        for i in due:
            for side in sides:
                for r, values in enumerate(base):
                    moved = values.copy()
                    moved[i] += side * self.differences[i]
                    tasks.append((r, moved, self.spectra[r]))
        found = iter(self.evaluate(tasks))
        here = [next(found) for _ in base]
        for i in due:
            forward = [next(found) for _ in base]
            back = [next(found) for _ in base] if self.central else here
            span = len(sides) * self.differences[i]
            self.columns[i] = [(a - b) / span for a, b in zip(forward, back, strict=True)]

    def assembled(self, theta: Array) -> Array:
        """Columns of the recordings in one matrix; a factor's column is that of its torque in its recording."""
        sizes = [len(part) for part in self.columns[0]]
        p, m = len(self.experiment.free), len(self.scaled)
        J = np.zeros((sum(sizes), len(theta)))
        begin = 0
        for r, size in enumerate(sizes):
            rows = slice(begin, begin + size)
            begin += size
            for index in range(p):
                J[rows, index] = self.columns[index][r]
            for k, index in enumerate(self.scaled):
                J[rows, p + r * m + k] = self.columns[index][r] * theta[index]
                J[rows, index] *= 1.0 + theta[p + r * m + k]
        return J


def with_factors(parameters: Parameters, experiment: Experiment, run_to_run: float) -> Parameters:
    """The free numbers' priors, and those of the run-to-run factors less 1."""
    scaled = frictions(experiment)
    names = tuple(
        f"{recording.name}: {experiment.free[index].name}"
        for recording in experiment.recordings
        for index in scaled
    )
    count = len(names)
    assert parameters.lower is not None and parameters.upper is not None
    return Parameters(
        (*parameters.names, *names),
        np.concatenate([parameters.value, np.zeros(count)]),
        np.concatenate([parameters.sigma, np.full(count, run_to_run)]),
        np.concatenate([parameters.lower, np.full(count, -1.0)]),
        np.concatenate([parameters.upper, np.full(count, np.inf)]),
    )


def identify(
    experiment: Experiment, evaluate_with: Evaluators, settings: Settings, say: Say
) -> Identification:
    """Identify the free numbers of `experiment` (see `gearbox`) and of the rest that shows.

    Starts are found and followed without the lowest frequencies; the best is refined on all of them with central
    differences and noise spectra taken from the residual.
    """
    coarse = replace(experiment, lowest_Hz=settings.screening_lowest_Hz)
    sensor = [sensor_spectra(coarse, recording) for recording in coarse.recordings]
    gears = len(experiment.free)
    with say("Screening: resonances and phases"):
        matched = match_resonances(coarse, coarse.nominal, sensor)
        begin = starts(coarse, matched, sensor, evaluate_with(coarse), settings.starts)
    with say("Which other numbers show in the recordings"):
        coarse, columns = _with_others(coarse, begin[0].values, sensor, evaluate_with, settings)
    modes = []
    for number, start in enumerate(begin, 1):
        with say(f"Search from start {number} of {len(begin)}"):
            values = np.concatenate([start.values, coarse.nominal[gears:]])
            modes.append(_search(coarse, start, values, sensor, evaluate_with, gears, columns, settings))
    final = replace(experiment, free=coarse.free, lowest_Hz=settings.lowest_Hz)
    with say("Refining the best"):
        best = min(modes, key=lambda mode: mode.cost)
        return _refine(final, tuple(modes), best.differences, sensor, evaluate_with, gears, settings)


def _with_others(
    coarse: Experiment,
    values: Array,
    spectra: Sequence[Spectra],
    evaluate_with: Evaluators,
    settings: Settings,
) -> tuple[Experiment, dict[int, list[Array]]]:
    """The experiment with every number free that shows, and the columns of those beyond the gearbox."""
    gears = len(coarse.free)
    wide = replace(coarse, free=(*coarse.free, *others(coarse.rig, coarse.free)))
    parameters = prior(wide)
    evaluate = evaluate_with(wide)
    blank: dict[int, list[Array]] = {index: [] for index in range(gears)}
    objective = Objective(
        wide, spectra, evaluate, _first_differences(parameters), 0, central=False, columns=blank
    )
    objective.difference(np.concatenate([values, parameters.value[gears:]]))
    length = _lengths(objective.columns, range(gears, len(wide.free)))
    shows = [
        gears + k for k in np.flatnonzero(length * parameters.sigma[gears:] > settings.negligible).tolist()
    ]
    columns = {gears + new: objective.columns[old] for new, old in enumerate(shows)}
    return replace(wide, free=(*coarse.free, *(wide.free[i] for i in shows))), columns


def _search(
    coarse: Experiment,
    start: Start,
    values: Array,
    sensor: Sequence[Spectra],
    evaluate_with: Evaluators,
    gears: int,
    columns: Mapping[int, list[Array]],
    settings: Settings,
) -> Mode:
    """Follow one start. While much is unexplained, residuals count for less, so that no step is rash."""
    parameters = with_factors(prior(coarse), coarse, settings.run_to_run)
    theta = np.concatenate([values, np.zeros(len(parameters.value) - len(values))])
    evaluate = evaluate_with(coarse)
    objective = Objective(
        coarse,
        sensor,
        evaluate,
        _first_differences(prior(coarse)),
        gears,
        central=False,
        columns=columns,
    )

    polar = Polar.of(phases(coarse.rig, coarse.effects, coarse.free), parameters)

    def weighted(weight: float) -> tuple[Residual, Residual]:
        def misfit(u: Array) -> Array:
            at = polar.back(u)
            return np.concatenate([weight * objective.residual(at), polar.excess(at)])

        def slopes(u: Array) -> Array:
            at = polar.back(u)
            return polar.jacobian(weight * objective.jacobian(at), at)

        return misfit, slopes

    for number in range(1, settings.rounds + 1):
        weight = 1.0 / max(1.0, float(np.sqrt(np.mean(objective.residual(theta) ** 2))))
        residual, jacobian = weighted(weight)
        fit = fit_map(
            residual,
            polar.flat_parameters,
            jacobian=jacobian,
            start=polar.flat(theta),
            gain=_ROUGH * settings.gain,
            iterations=2,
        )
        theta = polar.back(fit.value)
        objective.differences = _settled(objective.columns, prior(coarse))
        calm = weight > _CALM and fit.checks[0].passed
        if calm or number % _REPHASED == 0:
            moved = _rephased(objective, theta, parameters)
            if calm and np.array_equal(moved, theta):
                break
            theta = moved
            objective.columns.clear()  # the others' were those of a plant further off
    misfit = objective.residual(theta)
    excess = (theta - parameters.value) / parameters.sigma
    return Mode(start, theta, float(misfit @ misfit + excess @ excess), objective.differences)


def _rephased(objective: Objective, theta: Array, parameters: Parameters) -> Array:
    """Return `theta` with phases moved to a better minimum, where there is one.

    What a weak effect does shows only once the strong ones are right. Each phase that enters smoothly is tried at eight
    values, with its amplitude's prior, all other numbers following as the linear model has it.
    """
    experiment = objective.experiment
    J = objective.assembled(theta)
    weights = 1.0 / parameters.sigma
    turns = np.arange(8) * (np.pi / 4.0)
    best = theta.copy()
    for pair in phases(experiment.rig, experiment.effects, experiment.free):
        if not pair.smooth:
            continue
        rest = np.delete(np.arange(len(theta)), [pair.phase, pair.amplitude])
        Q, R = np.linalg.qr(np.vstack([J[:, rest], np.diag(weights)[:, rest]]))
        trials = [theta]
        for turn in turns:
            trial = theta.copy()
            trial[[pair.phase, pair.amplitude]] = turn, parameters.value[pair.amplitude]
            trials.append(trial)
        costs, moves = [], []
        for at, r in zip(trials, objective.residuals(trials), strict=True):
            left = np.concatenate([r, (at - parameters.value) * weights])
            along = Q.T @ left
            costs.append(float(left @ left - along @ along))
            moves.append(-np.linalg.solve(R, along))
        chosen = int(np.argmin(costs))
        if costs[chosen] < costs[0] - _BETTER:
            best[[pair.phase, pair.amplitude]] = trials[chosen][[pair.phase, pair.amplitude]]
            best[rest] += moves[chosen] - moves[0]
    assert parameters.lower is not None and parameters.upper is not None
    clipped: Array = np.clip(best, parameters.lower, parameters.upper)
    return clipped


def _first_differences(parameters: Parameters) -> Array:
    differences: Array = np.where(np.isfinite(parameters.sigma), parameters.sigma, 1.0) * _DIFFERENCE
    return differences


def _settled(columns: Mapping[int, list[Array]], parameters: Parameters) -> Array:
    """Differences that move the whitened residual by about `_SEEN`."""
    size = np.where(np.isfinite(parameters.sigma), parameters.sigma, 1.0)
    length = _lengths(columns, range(len(size)))
    settled: Array = np.clip(
        _SEEN / np.maximum(length, 1e-30), _LEAST_DIFFERENCE * size, _MOST_DIFFERENCE * size
    )
    return settled


def _refine(
    final: Experiment,
    modes: tuple[Mode, ...],
    differences: Array,
    sensor: Sequence[Spectra],
    evaluate_with: Evaluators,
    gears: int,
    settings: Settings,
) -> Identification:
    """First with the sensor's noise, then with that of the residual."""
    parameters = with_factors(prior(final), final, settings.run_to_run)
    evaluate = evaluate_with(final)
    theta = min(modes, key=lambda mode: mode.cost).values
    spectra: Sequence[Spectra] = sensor
    for last in (False, True):
        objective = Objective(final, spectra, evaluate, differences, gears, central=True)
        fit = fit_map(
            objective.residual,
            parameters,
            jacobian=objective.jacobian,
            start=theta,
            gain=settings.gain,
            iterations=settings.iterations,
        )
        theta = fit.value
        if not last:
            differences = _settled(objective.columns, prior(final))
            spectra = [
                estimated_spectra(final, recording, unexplained(final, recording, values, noise))
                for recording, values, noise in zip(
                    final.recordings, objective.in_recordings(theta), spectra, strict=True
                )
            ]
    return Identification(final, fit, objective.assembled(theta), tuple(spectra), modes, parameters)


def _lengths(columns: Mapping[int, list[Array]], which: range) -> Array:
    return np.array([np.sqrt(sum(float(part @ part) for part in columns[i])) for i in which])


def intervals(found: Identification, evaluate_with: Evaluators) -> tuple[Profile, ...]:
    """Profile-likelihood intervals of the paper's five critical parameters of every drive."""
    names = [scalar.name for scalar in found.experiment.free if scalar.name.rpartition(".")[2] in CRITICAL]
    objective = Objective(
        found.experiment,
        found.spectra,
        evaluate_with(found.experiment),
        np.ones(len(found.experiment.free)),
        len(found.experiment.free),
        central=False,
    )
    return profiles(names, found.fit, found.parameters, objective.residuals, found.jacobian)
