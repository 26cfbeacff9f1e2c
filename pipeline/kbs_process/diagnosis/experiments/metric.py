"""How trials are compared: whitened by the floor, each trial's own nuisances taken out.

A channel that shows something in part of a trial only, as an encoder whose joint rests, has as many numbers as all
others, alike from one frequency to the next: they count for as many as are independent.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.floor import Floor
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, Prediction
from kbs_process.diagnosis.experiments.nuisance import nuisances
from kbs_process.diagnosis.experiments.whiten import Projector, Whitener, independent
from kbs_process.signals.records import Array

_WIDTH_HZ = 0.2  # of what is averaged: a lightly damped resonance, and by how much a pose shifts it
_LEAST = 8  # frequencies in it, of short trials


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


def softened(
    experiment: Experiment,
    metric: Sequence[Metric],
    residual: Mapping[int, Array],
    predicted: Mapping[int, Prediction],
    hypothesis: Hypothesis,
) -> tuple[Metric, ...]:
    r"""Metrics of all trials, softened by the whitened residuals (rows,) of some of them.

    In the noise's metric alone, physics that was left out pulls known numbers as far as that lowers what it leaves, at
    a resonance most of all. If what some numbers leave over is taken for one more noise of its own density, likelihood
    weighs

        W' = diag(max(1, v(f)))^(-1/2) W,
        v(f) = mean over neighbouring frequencies and the trials fitted of |z|^2 / 2,

    z whitened by the floor, of unit variance where nothing is missing. There the metric is the floor's, nearly. It is
    taken once: what pulled numbers leave is about as large, and as wide, as what those leave that were not.
    Source: P. Whittle, Estimation and information in stationary time series, Arkiv foer Matematik 2 (1953) 423: the
        likelihood of what is left, by its own spectrum.
    Validity: to begin a search for what is missing. What is left is no noise, and nothing is judged by this metric.

    `predicted` by drive and `hypothesis` are those that left these residuals: trials' own nuisances are along them.
    """
    f, v = excess_density(metric, residual)
    found = []
    for trial, own in zip(experiment.trials, metric, strict=True):
        here = np.stack([np.interp(own.whiten.f, f, channel) for channel in v.T], axis=1)
        whiten = replace(own.whiten, weights=own.whiten.weights / np.sqrt(here)[:, :, None])
        N, precision = nuisances(experiment, trial, predicted[trial.drive], hypothesis)
        found.append(Metric(whiten, own.share, Projector.of(counted(whiten, own.share, N), precision)))
    return tuple(found)


def excess_density(metric: Sequence[Metric], residual: Mapping[int, Array]) -> tuple[Array, Array]:
    """Frequencies (b,), Hz, and density (b, c) of whitened residuals there, 1 where no more than noise is left."""
    f = max((metric[k].whiten.f for k in residual), key=len)
    total = np.zeros((len(f), metric[0].whiten.shape[2]))
    counted_for = sum((metric[k].share for k in residual), np.zeros(total.shape[1]))
    for k, z in residual.items():
        own = metric[k].whiten.f
        power = 0.5 * np.sum(metric[k].layout(z) ** 2, axis=0)
        apart = float(own[1] - own[0]) if len(own) > 1 else _WIDTH_HZ
        smooth = uniform_filter1d(power, max(_LEAST, round(_WIDTH_HZ / apart)), axis=0, mode="nearest")
        total += metric[k].share * np.stack([np.interp(f, own, channel) for channel in smooth.T], axis=1)
    return f, np.maximum(total / np.where(counted_for > 0.0, counted_for, 1.0), 1.0)
