r"""The metric of a model that lacks something: by the noise, and by the spectrum of what is left over.

In the noise's metric alone, physics that was left out pulls known numbers as far as that lowers what it leaves, at a
resonance most of all. If what some numbers leave over is taken for one more noise of its own density, likelihood weighs

    W' = diag(max(1, v(f)))^(-1/2) W,   v(f) = mean over neighbouring frequencies and the trials fitted of |z|^2 / 2,

z whitened by the floor, of unit variance where nothing is missing. There the metric is the floor's, nearly. It is taken
once: what pulled numbers leave is about as large, and as wide, as what those leave that were not.
Source: P. Whittle, Estimation and information in stationary time series, Arkiv foer Matematik 2 (1953) 423: the
    likelihood of what is left, by its own spectrum.
Validity: to begin a search for what is missing. What is left is no noise, and nothing is judged by this metric.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, Prediction
from kbs_process.diagnosis.experiments.metric import Metric, counted
from kbs_process.diagnosis.experiments.nuisance import nuisances
from kbs_process.diagnosis.experiments.whiten import Projector
from kbs_process.signals.records import Array

_WIDTH_HZ = 0.2  # of what is averaged: a lightly damped resonance, and by how much a pose shifts it
_LEAST = 8  # frequencies in it, of short trials


def softened(
    experiment: Experiment,
    metric: Sequence[Metric],
    residual: Mapping[int, Array],
    predicted: Mapping[int, Prediction],
    hypothesis: Hypothesis,
) -> tuple[Metric, ...]:
    """Metrics of all trials, softened by the whitened residuals (rows,) of some of them.

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
