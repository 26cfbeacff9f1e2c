"""Residuals of many parameter sets on all cores: the recordings go to every process once."""

from __future__ import annotations

from dataclasses import dataclass, replace

from kbs_process.identification.output_error import Experiment, Measured, residual
from kbs_process.identification.screening import Evaluate, Task
from kbs_process.results.parallel import Crew
from kbs_process.signals.records import Array


@dataclass(frozen=True, slots=True, eq=False)
class _Job:
    """One residual to be computed; `experiment` comes without its recordings."""

    experiment: Experiment
    task: Task


def evaluator(crew: Crew[tuple[Measured, ...]], experiment: Experiment) -> Evaluate:
    """What evaluates residuals of `experiment`, whose recordings the crew holds, in the order of the tasks."""
    bare = replace(experiment, recordings=())
    return lambda tasks: list(crew.map(_residual, [_Job(bare, task) for task in tasks]))


def _residual(recordings: tuple[Measured, ...], job: _Job) -> Array:
    index, values, spectra = job.task
    return residual(replace(job.experiment, recordings=recordings), recordings[index], values, spectra)
