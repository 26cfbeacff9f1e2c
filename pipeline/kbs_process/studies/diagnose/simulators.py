"""Predictions of many hypotheses on all cores."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from types import TracebackType

from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.hypothesis import Prediction, Task, predict_together
from kbs_process.plant.predict import LANES


class Simulators:
    """Threads that simulate an experiment's drives; called with tasks, as `hypothesis.Simulate` says.

    The compiled plant runs without the interpreter's lock. No bit of a prediction depends on what runs beside it, or on
    the number of threads.
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
        """Return predictions in the order of the tasks; those of one drive are made side by side."""
        alike: dict[tuple[int, tuple[str, ...]], list[int]] = {}
        for k, (drive, hypothesis) in enumerate(tasks):
            alike.setdefault((drive, hypothesis.effects), []).append(k)
        groups = [g[begin : begin + LANES] for g in alike.values() for begin in range(0, len(g), LANES)]
        made = self._pool.map(lambda group: self._predict([tasks[k] for k in group]), groups)
        found: dict[int, Prediction] = {}
        for group, predictions in zip(groups, made, strict=True):
            found |= dict(zip(group, predictions, strict=True))
        return [found[k] for k in range(len(tasks))]

    def _predict(self, tasks: Sequence[Task]) -> list[Prediction]:
        drive = tasks[0][0]
        return predict_together([hypothesis for _, hypothesis in tasks], self._experiment, drive)
