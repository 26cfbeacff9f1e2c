"""Identification of the plant's numbers from recordings: starts, search, refinement, uncertainty."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from kbs_process.estimation.descent import descend
from kbs_process.estimation.fit import Check, Fit, Parameters, fit_map, triangle
from kbs_process.estimation.linearise import Unpredicted, draws, linearised
from kbs_process.estimation.profile import Profile, profiles
from kbs_process.identification.contact import left_to_contact
from kbs_process.identification.objective import Objective, first_differences, lengths
from kbs_process.identification.output_error import Experiment, Spectra, estimated_spectra, sensor_spectra, unexplained
from kbs_process.identification.screening import Evaluate, contacts, match_resonances, starts
from kbs_process.identification.search import Mode, follow
from kbs_process.identification.unknowns import CRITICAL, others, prior, with_factors
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array

_ROUGH = 10.0  # what ends a search, over what ends a refinement
_STEPS = 6  # with the same slopes
_PHASE = 0.25  # rad, the scale of a phase in differences: its sine is nearly straight
_FINE_STEP = 5e-4  # s: the plant's own step moves estimates by up to one sigma, this one by less than a tenth
_DRAWS = 48  # of the posterior: events that flip within it are few, and each does in many of them
_CHANCE = 1e-3  # of a chi-square, below which a check fails
_STILL = 0.3  # sigma, rms: a step that moves by less adds less than 5 % to an error

Evaluators = Callable[[Experiment], Evaluate]  # makes what evaluates the residuals of an experiment
Say = Callable[[str], AbstractContextManager[object]]  # opens a piece of work that is told to a user


@dataclass(frozen=True, slots=True)
class Settings:
    """What the identification takes for granted."""

    run_to_run: float = 0.02  # standard deviation of a friction torque from run to run, of itself
    starts: int = 2  # that are followed
    lowest_Hz: float = 0.5  # below: masses, CoGs and drift; gears lose at most 3 % of what is known of them
    negligible: float = 0.1  # a number of the rig that moves all residuals by less, at one sigma, is fixed
    rounds: int = 12  # of a search: slopes taken
    refinements: int = 4  # likewise
    gain: float = 1.0  # of -2 log likelihood: a descent's step that promises less is not made


@dataclass(frozen=True, slots=True, eq=False)
class Identification:
    """The estimate and everything a reader may ask of it."""

    experiment: Experiment  # its `free` are the numbers below
    fit: Fit  # free numbers, then run-to-run factors
    jacobian: Array  # (n, p) of the whitened residual there
    spectra: tuple[Spectra, ...]
    correction: tuple[Array, ...]  # of each recording's residual: what a finer step changes
    unpredicted: Unpredicted  # of the residual: events of sticking that flip within the posterior
    modes: tuple[Mode, ...]
    parameters: Parameters

    @property
    def values(self) -> Array:
        """(p,) of the free numbers."""
        return self.fit.value[: len(self.experiment.free)]

    @property
    def rig(self) -> Rig:
        return self.experiment.rig_at(self.values)

    def objective(self, evaluate_with: Evaluators) -> Objective:
        """The residual that was made small in the end."""
        p = len(self.experiment.free)
        return Objective(
            self.experiment,
            self.spectra,
            evaluate_with(self.experiment),
            np.ones(p),
            p,
            central=False,
            correction=self.correction,
            unpredicted=self.unpredicted,
        )


def identify(experiment: Experiment, evaluate_with: Evaluators, settings: Settings, say: Say) -> Identification:
    """Identify the free numbers of `experiment` (see `unknowns.gearbox`) and of the rest that shows.

    The best of the followed starts is refined with central differences, a finer step, noise spectra taken from the
    residual, and what no slope predicts as noise.
    """
    sensor = [sensor_spectra(experiment, recording) for recording in experiment.recordings]
    gears = len(experiment.free)
    with say("Screening: resonances and phases"):
        matched = match_resonances(experiment, experiment.nominal, sensor)
        begin = starts(experiment, matched, sensor, evaluate_with(experiment), settings.starts)
    with say("Which other numbers show in the recordings"):
        full, columns = _with_others(experiment, begin[0].values, sensor, evaluate_with, settings)
    modes = []
    for number, start in enumerate(begin, 1):
        with say(f"Search from start {number} of {len(begin)}"):
            mode = follow(
                full,
                start,
                np.concatenate([start.values, full.nominal[gears:]]),
                sensor,
                evaluate_with(full),
                columns,
                gears=gears,
                run_to_run=settings.run_to_run,
                rounds=settings.rounds,
                gain=_ROUGH * settings.gain,
            )
            modes.append(mode)
    with say("Refining the best"):
        best = min(modes, key=lambda mode: mode.cost)
        return _refine(full, tuple(modes), best, sensor, evaluate_with, settings)


def _with_others(
    experiment: Experiment, values: Array, spectra: Sequence[Spectra], evaluate_with: Evaluators, settings: Settings
) -> tuple[Experiment, dict[int, list[Array]]]:
    """The experiment with every number free that shows, and the columns of those beyond the gearbox."""
    gears = len(experiment.free)
    wide = replace(experiment, free=(*experiment.free, *others(experiment.rig, experiment.free)))
    parameters = prior(wide)
    evaluate = evaluate_with(wide)
    blank: dict[int, list[Array]] = {index: [] for index in range(gears)}
    objective = Objective(wide, spectra, evaluate, first_differences(parameters), 0, central=False, columns=blank)
    objective.difference(np.concatenate([values, parameters.value[gears:]]))
    length = lengths(objective.columns, range(gears, len(wide.free)))
    shows = [gears + k for k in np.flatnonzero(length * parameters.sigma[gears:] > settings.negligible).tolist()]
    columns = {gears + new: objective.columns[old] for new, old in enumerate(shows)}
    return replace(wide, free=(*experiment.free, *(wide.free[i] for i in shows))), columns


def _refine(
    final: Experiment,
    modes: tuple[Mode, ...],
    best: Mode,
    sensor: Sequence[Spectra],
    evaluate_with: Evaluators,
    settings: Settings,
) -> Identification:
    """Descend once with the noise that the residual shows; then step to the posterior's mean until it stays there."""
    parameters = with_factors(prior(final), final, settings.run_to_run)
    evaluate, fine = evaluate_with(final), evaluate_with(replace(final, step_s=_FINE_STEP))
    theta, p = best.values, len(final.free)
    objective = Objective(final, sensor, evaluate, first_differences(prior(final)), p, central=True)
    spectra = [
        estimated_spectra(final, recording, unexplained(final, recording, values, noise))
        for recording, values, noise in zip(final.recordings, objective.in_recordings(theta), sensor, strict=True)
    ]
    objective = Objective(final, spectra, evaluate, objective.differences, p, central=True)
    scale = np.where(np.isfinite(parameters.sigma), parameters.sigma, _PHASE)[:p]

    def slopes(at: Array, known: Array) -> Array:
        tasks = objective.tasks([at])
        objective.correct([a - b for a, b in zip(fine(tasks), evaluate(tasks), strict=True)])
        return objective.along_principal(at, known, scale)

    J = slopes(theta, best.triangle)
    theta = descend(objective.residual, J, parameters, theta, gain=settings.gain, steps=_STEPS).value
    C = np.asarray(np.linalg.inv(J.T @ J + np.diag(parameters.sigma**-2.0)), dtype=np.float64)
    rng = np.random.default_rng(0)
    moved, rounds = np.inf, 0
    while moved > _STILL and rounds < settings.refinements:
        J = slopes(theta, triangle(J[:, :p]))
        points = draws(theta, C, parameters, _DRAWS, rng)
        model = linearised(objective.residuals, J, theta, points)
        mean, C = model.posterior(parameters)
        step = mean - theta
        moved, rounds = float(np.sqrt(step @ np.linalg.solve(C, step) / len(step))), rounds + 1
        theta = parameters.clipped(mean)
    objective.unpredicted = model.unpredicted
    fit = fit_map(objective.residual, parameters, jacobian=lambda at: model.slopes, start=theta, iterations=0)
    tests = {
        final.free[contact.torque].name: left_to_contact(objective.residuals, theta, model.slopes, parameters, contact)
        for contact in contacts(final.rig, final.effects, final.free)
    }
    told = f"the last of {rounds} linearisations moved the estimate by {moved:.2g} sigma, rms"
    checks = (Check("converged", moved <= _STILL, told), *fit.checks[1:], _contact_check(tests))
    return Identification(
        final,
        replace(fit, checks=checks),
        model.slopes,
        tuple(spectra),
        tuple(objective.correction),
        model.unpredicted,
        modes,
        parameters,
    )


def _contact_check(tests: Mapping[str, tuple[float, int]]) -> Check:
    """Does a friction that is free over a tooth's turn explain more than chance does?"""
    chances = {name: float(chi2.sf(gained, max(count, 1))) for name, (gained, count) in tests.items()}
    told = [f"{name}: chi-square {tests[name][0]:.0f} of {tests[name][1]}" for name in tests]
    return Check("tooth contact", all(p > _CHANCE for p in chances.values()), ", ".join(told))


def intervals(found: Identification, evaluate_with: Evaluators) -> tuple[Profile, ...]:
    """Profile-likelihood intervals of the paper's five critical parameters of every drive."""
    names = [scalar.name for scalar in found.experiment.free if scalar.name.rpartition(".")[2] in CRITICAL]
    objective = found.objective(evaluate_with)
    return profiles(names, found.fit, found.parameters, objective.residuals, found.jacobian)
