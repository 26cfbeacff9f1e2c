"""Identification of the plant's numbers from recordings: starts, search, refinement, uncertainty."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace

import numpy as np

from kbs_process.estimation.descent import descend
from kbs_process.estimation.fit import Check, Fit, Parameters, fit_map, triangle
from kbs_process.estimation.profile import Profile, profiles
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array
from kbs_process.stages.objective import Objective, first_differences, lengths
from kbs_process.stages.output_error import (
    Experiment,
    Spectra,
    estimated_spectra,
    sensor_spectra,
    unexplained,
)
from kbs_process.stages.screening import Evaluate, match_resonances, starts
from kbs_process.stages.search import Mode, follow
from kbs_process.stages.unknowns import CRITICAL, frictions, gearbox, others, prior, with_factors

__all__ = [
    "Identification",
    "Mode",
    "Settings",
    "frictions",
    "gearbox",
    "identify",
    "intervals",
    "others",
    "prior",
    "with_factors",
]

_ROUGH = 10.0  # what ends a search, over what ends a refinement
_STEPS = 6  # with the same slopes
_PHASE = 0.25  # rad, the scale of a phase in differences: its sine is nearly straight
_FINE_STEP = 5e-4  # s: the plant's own step moves estimates by up to one sigma, this one by less than a tenth

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
    refinements: int = 3  # likewise
    gain: float = 1.0  # of -2 log likelihood: a step that promises less ends the refinement


@dataclass(frozen=True, slots=True, eq=False)
class Identification:
    """The estimate and everything a reader may ask of it."""

    experiment: Experiment  # its `free` are the numbers below
    fit: Fit  # free numbers, then run-to-run factors
    jacobian: Array  # (n, p) of the whitened residual there
    spectra: tuple[Spectra, ...]
    correction: tuple[Array, ...]  # of each recording's residual: what a finer step changes
    modes: tuple[Mode, ...]
    parameters: Parameters

    @property
    def values(self) -> Array:
        """(p,) of the free numbers."""
        return self.fit.value[: len(self.experiment.free)]

    @property
    def rig(self) -> Rig:
        return self.experiment.rig_at(self.values)


def identify(
    experiment: Experiment, evaluate_with: Evaluators, settings: Settings, say: Say
) -> Identification:
    """Identify the free numbers of `experiment` (see `unknowns.gearbox`) and of the rest that shows.

    The best of the followed starts is refined with central differences, a finer step, and noise spectra taken from the
    residual.
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
    experiment: Experiment,
    values: Array,
    spectra: Sequence[Spectra],
    evaluate_with: Evaluators,
    settings: Settings,
) -> tuple[Experiment, dict[int, list[Array]]]:
    """The experiment with every number free that shows, and the columns of those beyond the gearbox."""
    gears = len(experiment.free)
    wide = replace(experiment, free=(*experiment.free, *others(experiment.rig, experiment.free)))
    parameters = prior(wide)
    evaluate = evaluate_with(wide)
    blank: dict[int, list[Array]] = {index: [] for index in range(gears)}
    objective = Objective(
        wide, spectra, evaluate, first_differences(parameters), 0, central=False, columns=blank
    )
    objective.difference(np.concatenate([values, parameters.value[gears:]]))
    length = lengths(objective.columns, range(gears, len(wide.free)))
    shows = [
        gears + k for k in np.flatnonzero(length * parameters.sigma[gears:] > settings.negligible).tolist()
    ]
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
    """Descend with the noise that the residual shows, until a descent with new slopes gains next to nothing."""
    parameters = with_factors(prior(final), final, settings.run_to_run)
    evaluate, fine = evaluate_with(final), evaluate_with(replace(final, step_s=_FINE_STEP))
    theta, p = best.values, len(final.free)
    objective = Objective(final, sensor, evaluate, first_differences(prior(final)), p, central=True)
    spectra = [
        estimated_spectra(final, recording, unexplained(final, recording, values, noise))
        for recording, values, noise in zip(
            final.recordings, objective.in_recordings(theta), sensor, strict=True
        )
    ]
    objective = Objective(final, spectra, evaluate, objective.differences, p, central=True)
    descents, gained, R = 0, np.inf, best.triangle
    scale = np.where(np.isfinite(parameters.sigma), parameters.sigma, _PHASE)[:p]
    while gained >= settings.gain and descents < settings.refinements:
        tasks = objective.tasks([theta])
        objective.correct([a - b for a, b in zip(fine(tasks), evaluate(tasks), strict=True)])
        J = objective.along_principal(theta, R, scale)
        R = triangle(J[:, :p])
        down = descend(objective.residual, J, parameters, theta, gain=settings.gain, steps=_STEPS)
        theta, gained, descents = down.value, down.gained, descents + 1
    fit = fit_map(objective.residual, parameters, jacobian=lambda at: J, start=theta, iterations=0)
    told = f"the last of {descents} descents gained {gained:.2g} of -2 log likelihood"
    checks = (Check("converged", gained < settings.gain, told), *fit.checks[1:])
    return Identification(
        final,
        replace(fit, checks=checks, iterations=descents),
        J,
        tuple(spectra),
        tuple(objective.correction),
        modes,
        parameters,
    )


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
        correction=found.correction,
    )
    return profiles(names, found.fit, found.parameters, objective.residuals, found.jacobian)
