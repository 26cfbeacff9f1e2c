"""How much has been simulated, and whether a search goes on: what ends it is the same on every machine."""

from __future__ import annotations

from collections.abc import Sequence

from kbs_process.diagnosis.hypothesis import Prediction, Simulate, Task
from kbs_process.diagnosis.known import Known
from kbs_process.diagnosis.thresholds import EFFORT


class Effort:
    """Simulates, as `hypothesis.Simulate` says, and counts what it costs: seconds of each plant, times its effects."""

    def __init__(self, simulate: Simulate, known: Known) -> None:
        self._simulate = simulate
        experiment = known.experiment
        self._seconds = [drive.n * experiment.dt for drive in experiment.drives]
        references = {experiment.reference(trial.trajectory) for trial in experiment.trials}
        every = sum(self._seconds[drive] for drive in references) * len(known.free)
        self._pass = every * max(1, len(known.hypothesis.effects))
        self._cost = 0.0

    def __call__(self, tasks: Sequence[Task]) -> list[Prediction]:
        """Return predictions in the order of the tasks."""
        self._cost += sum(self._seconds[drive] * max(1, len(one.effects)) for drive, one in tasks)
        return self._simulate(tasks)

    @property
    def passes(self) -> float:
        """The same in slopes of all known numbers, each motion simulated once with each of them moved."""
        return self._cost / self._pass

    @property
    def spent(self) -> bool:
        """Whether no more laws are looked for."""
        return self.passes > EFFORT
