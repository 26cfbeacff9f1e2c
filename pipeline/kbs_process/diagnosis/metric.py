"""How trials are compared: whitened by the floor, each trial's own nuisances taken out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kbs_process.diagnosis.experiment import Experiment
from kbs_process.diagnosis.floor import Floor
from kbs_process.diagnosis.hypothesis import Hypothesis, Prediction
from kbs_process.diagnosis.nuisance import nuisances
from kbs_process.diagnosis.whiten import Projector, Whitener
from kbs_process.signals.records import Array


@dataclass(frozen=True, slots=True, eq=False)
class Metric:
    """The map of one trial: linear, the same for residuals, slopes and signatures."""

    whiten: Whitener
    project: Projector

    def __call__(self, x: Array) -> Array:
        """(rows,) of x (n, c), (rows, k) of x (n, c, k)."""
        return self.project(self.whiten(x))

    @property
    def rows(self) -> int:
        """Numbers of a residual that are noise of their own: those of channels that are seen, less free nuisances'."""
        channels = int(np.count_nonzero(self.whiten.window.any(axis=0)))
        free = self.project.basis.shape[1] - self.project.tail.shape[0]
        return int(2 * len(self.whiten.f) * channels - free)

    def layout(self, z: Array) -> Array:
        """(2, b, c) of a residual: real and imaginary parts, frequencies, channels; the nuisances' priors left out."""
        shape = self.whiten.shape
        return z[: int(np.prod(shape))].reshape(shape)


def metrics(
    experiment: Experiment,
    floor: Floor,
    predicted: Mapping[int, Prediction],
    hypothesis: Hypothesis | None = None,
) -> tuple[Metric, ...]:
    """Those of all trials, by predictions of all drives (whose path is where encoders round).

    `hypothesis` is what predicts them; without it, the files' rig.
    """
    present = hypothesis or Hypothesis(experiment.rig, experiment.effects)
    found = []
    for trial in experiment.trials:
        near = predicted[trial.drive]
        whiten = floor.whitener(trial, near.values)
        N, precision = nuisances(experiment, trial, near, present)
        found.append(Metric(whiten, Projector.of(whiten(N), precision)))
    return tuple(found)
