"""Predictions of many hypotheses on all cores."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from types import TracebackType

from kbs_process.diagnosis.experiment import Experiment
from kbs_process.diagnosis.hypothesis import Prediction, Task, predict


class Simulators:
    """Threads that simulate an experiment's drives; called with tasks, as `hypothesis.Simulate` says.

    The compiled plant runs without the interpreter's lock. Predictions come out as they would alone: the number of
    threads changes no bit.
    """

    def __init__(self, experiment: Experiment, threads: int | None = None) -> None:
        self._experiment = experiment
        self._pool = ThreadPoolExecutor(threads or len(os.sched_getaffinity(0)))

    def __enter__(self) -> Simulators:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._pool.shutdown(cancel_futures=True)

    def __call__(self, tasks: Sequence[Task]) -> list[Prediction]:
        return list(self._pool.map(self._predict, tasks))

    def _predict(self, task: Task) -> Prediction:
        drive, hypothesis = task
        return predict(hypothesis, self._experiment, drive)
