"""Residuals of many parameter sets on all cores: the recordings go to every process once."""

from __future__ import annotations

import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from types import TracebackType

from kbs_process.signals.records import Array
from kbs_process.stages.output_error import Experiment, Measured, residual
from kbs_process.stages.screening import Evaluate, Task

_held: list[tuple[Measured, ...]] = []  # the recordings of this process, if it is a worker


@dataclass(frozen=True, slots=True, eq=False)
class Job:
    """One residual to be computed; `experiment` comes without its recordings."""

    experiment: Experiment
    task: Task


class Workers:
    """Processes that hold the recordings. Residuals come out as they would alone: their number changes no bit."""

    def __init__(self, recordings: tuple[Measured, ...], processes: int) -> None:
        self._recordings = recordings
        # Started afresh: compiled code and threads do not survive being copied.
        context = multiprocessing.get_context("forkserver")
        self._pool = (
            ProcessPoolExecutor(processes, mp_context=context, initializer=_receive, initargs=(recordings,))
            if processes > 1
            else None
        )

    def __enter__(self) -> Workers:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)

    def evaluator(self, experiment: Experiment) -> Evaluate:
        """What evaluates residuals of `experiment`, in the order of the tasks."""
        pool = self._pool
        if pool is None or experiment.recordings is not self._recordings:
            return lambda tasks: [_residual(experiment, task) for task in tasks]
        bare = replace(experiment, recordings=())
        return lambda tasks: list(pool.map(_job, [Job(bare, task) for task in tasks]))


def _receive(recordings: tuple[Measured, ...]) -> None:
    _held.append(recordings)


def _job(job: Job) -> Array:
    return _residual(replace(job.experiment, recordings=_held[-1]), job.task)


def _residual(experiment: Experiment, task: Task) -> Array:
    index, values, spectra = task
    return residual(experiment, experiment.recordings[index], values, spectra)
