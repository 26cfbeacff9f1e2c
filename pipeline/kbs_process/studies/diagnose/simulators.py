"""Predictions of many hypotheses on all cores."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.hypothesis import Prediction, Simulate, Task, predict_together
from kbs_process.plant.predict import LANES


@contextmanager
def simulating(experiment: Experiment) -> Iterator[Simulate]:
    """Threads that simulate an experiment's drives; predictions come in the order of the tasks.

    Those of one drive are made side by side. The compiled plant runs without the interpreter's lock. No bit of a
    prediction depends on what runs beside it, or on the number of threads.
    """
    pool = ThreadPoolExecutor(len(os.sched_getaffinity(0)))

    def simulate(tasks: Sequence[Task]) -> list[Prediction]:
        alike: dict[tuple[int, tuple[str, ...]], list[int]] = {}
        for k, (drive, hypothesis) in enumerate(tasks):
            alike.setdefault((drive, hypothesis.effects), []).append(k)
        groups = [g[begin : begin + LANES] for g in alike.values() for begin in range(0, len(g), LANES)]
        made = pool.map(lambda g: predict_together([tasks[k][1] for k in g], experiment, tasks[g[0]][0]), groups)
        found: dict[int, Prediction] = {}
        for group, predictions in zip(groups, made, strict=True):
            found |= dict(zip(group, predictions, strict=True))
        return [found[k] for k in range(len(tasks))]

    try:
        yield simulate
    finally:
        pool.shutdown(cancel_futures=True)
