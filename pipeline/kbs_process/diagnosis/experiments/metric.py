"""How trials are compared: whitened by the floor, each trial's own nuisances taken out.

A channel that shows something in part of a trial only, as an encoder whose joint rests, has as many numbers as all
others, alike from one frequency to the next: they count for as many as are independent.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.floor import Floor
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, Prediction
from kbs_process.diagnosis.experiments.nuisance import nuisances
from kbs_process.diagnosis.experiments.whiten import Projector, Whitener, independent
from kbs_process.signals.records import Array


@dataclass(frozen=True, slots=True, eq=False)
class Metric:
    """The map of one trial: linear, the same for residuals, slopes and signatures."""

    whiten: Whitener
    share: Array  # (c,) of each channel's numbers that are independent
    project: Projector

    def __call__(self, x: Array) -> Array:
        """(rows,) of x (n, c), (rows, k) of x (n, c, k)."""
        return self.project(counted(self.whiten, self.share, x))

    @property
    def rows(self) -> int:
        """Numbers of a residual that are noise of their own: the independent ones, less free nuisances'."""
        free = int(self.project.basis.shape[1] - self.project.tail.shape[0])
        return max(1, round(2.0 * len(self.whiten.f) * float(self.share.sum())) - free)

    def layout(self, z: Array) -> Array:
        """(2, b, c) of a residual: real and imaginary parts, frequencies, channels; the nuisances' priors left out.

        Of unit variance each, whatever they count for.
        """
        shape = self.whiten.shape
        root = np.sqrt(np.where(self.share > 0.0, self.share, 1.0))
        return np.asarray(z[: int(np.prod(shape))].reshape(shape) / root, dtype=np.float64)

    def in_time(self, z: Array, n: int) -> Array:
        """(n, c) a residual as a whitened series: of unit variance, if the band is all that a series can show."""
        layout = self.layout(z)
        spectrum = np.zeros((n // 2 + 1, layout.shape[2]), dtype=complex)
        spectrum[self.whiten.inside] = layout[0] + 1j * layout[1]
        return np.asarray(np.fft.irfft(spectrum, n, axis=0) * np.sqrt(0.5 * n), dtype=np.float64)


def counted(whiten: Whitener, share: Array, x: Array) -> Array:
    """Whitened numbers that count for as many as are independent."""
    root = np.tile(np.sqrt(share), 2 * len(whiten.f))
    z = whiten(x)
    return np.asarray(z * (root if z.ndim == 1 else root[:, None]), dtype=np.float64)


def metrics(
    experiment: Experiment, floor: Floor, predicted: Mapping[int, Prediction], hypothesis: Hypothesis | None = None
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
        share = independent(whiten.window)
        found.append(Metric(whiten, share, Projector.of(counted(whiten, share, N), precision)))
    return tuple(found)
