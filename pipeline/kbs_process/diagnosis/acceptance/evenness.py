r"""How well a law's size is known where more is left over than noise: by the scatter of what each part asks for.

A law with free amplitudes follows whatever was left out of the plant: a clock that jumps does, for a while and in some
channels, what a friction does. By the noise such amplitudes are thousands of sigmas off zero. But a law that is there
asks for the same size at all times and in all channels, and what stands in asks for as much more here as for less
there. With d what the law does, whitened, less what all other numbers take up of it, e what is left over, and parts b,
the size of the law, in units of the one that it has, is 1 + T / D where the sums over all parts are D = d^T d and
T = d^T e (zero, but where the fit had not ended). Leaving a part out changes it, and it varies, by

    m_b = (d_b^T e_b - d_b^T d_b T / D) / (D - d_b^T d_b),   var = sum_b m_b^2,

which is 1 / D where e is noise; var is taken for no less than noise would make of such parts, as what lies within a
single one is known by none. Parts are windows of trajectories: what repeats leave over alike says no more together than
one of them. They are taken with each whitened channel a part of its own, and with all channels together, as what
one cause leaves in several is no evidence twice; the greater variance counts.
Source: B. Efron, The jackknife, the bootstrap and other resampling plans (SIAM, 1982), chapter 3; J. G. MacKinnon, H.
    White, Some heteroskedasticity-consistent covariance matrix estimators, J. Econometrics 29 (1985) 305.
Validity: windows longer than what is left over is correlated for: a resonance's ringing decays in 3 s. Those of
    recordings of less than two minutes are shorter than that of the port test.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.metric import Metric
from kbs_process.diagnosis.experiments.thresholds import WINDOW_S
from kbs_process.signals.records import Array

_FEWEST = 8  # windows of a recording, however short
_LEAST = 1e-12  # of what a law does, that the other parts show


def parts(experiment: Experiment, trial: int, metric: Metric, done: Array, left: Array) -> Array:
    """(2, windows, c) d_b^T e_b and d_b^T d_b of one trial, of whitened d (rows,) `done` by a law, e (rows,) `left`."""
    n = len(experiment.trials[trial].measured)
    count = min(n, max(_FEWEST, round(n * experiment.dt / WINDOW_S)))
    starts = np.linspace(0, n, count, endpoint=False).astype(np.intp)
    d, e = metric.in_time(done, n), metric.in_time(left, n)
    products = [np.add.reduceat(metric.share * d * one, starts, axis=0) for one in (e, d)]
    return np.asarray(products, dtype=np.float64)


def evenly(experiment: Experiment, of_trials: Mapping[int, Array]) -> float:
    """By how many sigmas of a law's size, as the `parts` of trials have it, it is off zero."""
    trajectories: dict[int, Array] = {}
    for k, own in of_trials.items():
        trajectory = experiment.trials[k].trajectory
        trajectories[trajectory] = trajectories.get(trajectory, 0.0) + own
    return min(
        _off_zero(np.concatenate([one.reshape(2, -1) for one in trajectories.values()], axis=1)),
        _off_zero(np.concatenate([one.sum(axis=2) for one in trajectories.values()], axis=1)),
    )


def _off_zero(of_parts: Array) -> float:
    pull, done = of_parts
    T, D = float(pull.sum()), float(done.sum())
    if not D > 0.0:
        return 0.0
    rest = np.maximum(D - done, _LEAST * D)
    moved = (pull - done * T / D) / rest
    variance = max(float(moved @ moved), float(np.sum(done / rest)) / D)
    return float((1.0 + T / D) / np.sqrt(variance))
