"""How much has been simulated, and whether a search goes on: what ends it is the same on every machine."""

from __future__ import annotations

import threading
from collections.abc import Sequence

from kbs_process.diagnosis.experiments.hypothesis import Prediction, Simulate, Task
from kbs_process.diagnosis.experiments.thresholds import EFFORT
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.diagnosis.nominal.parameters import COUPLING

_MOTIONS = 4  # of a pass, at least


class Effort:
    """Simulates, as `hypothesis.Simulate` says, and counts what it costs: samples of each plant, times its effects."""

    def __init__(self, simulate: Simulate, known: Known) -> None:
        self._simulate = simulate
        experiment = known.experiment
        # A measured motion takes the place of a plant, and costs next to nothing.
        self._samples = [0 if drive.schedule is None else drive.n for drive in experiment.drives]
        references = {experiment.reference(trial.trajectory) for trial in experiment.trials}
        # The cross-coupling's slopes are exact.
        moved = sum(scalar.quantity != COUPLING for scalar in known.free)
        # Few motions are searched for as long as some.
        motions = max(1.0, _MOTIONS / len(references)) * sum(self._samples[drive] for drive in references)
        self._pass = max(1.0, motions * max(1, moved) * max(1, len(known.hypothesis.effects)))
        self._cost = 0
        self._counting = threading.Lock()  # laws of a race are simulated side by side
        self.ended = False  # whether a search was told to

    def __call__(self, tasks: Sequence[Task]) -> list[Prediction]:
        """Return predictions in the order of the tasks."""
        cost = sum(self._samples[drive] * max(1, len(one.effects)) for drive, one in tasks)
        with self._counting:
            self._cost += cost
        return self._simulate(tasks)

    @property
    def passes(self) -> float:
        """The same in slopes of all known numbers: each motion, of four at least, with each of them moved."""
        return self._cost / self._pass

    def goes_on(self) -> bool:
        """Whether more laws are looked for; if not, the search is told to end."""
        self.ended = self.ended or self.passes > EFFORT
        return not self.ended
