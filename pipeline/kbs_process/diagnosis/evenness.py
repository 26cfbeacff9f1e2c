r"""How well a law's size is known where more is left over than noise: by the scatter of what each part asks for.

A law with free amplitudes follows whatever was left out of the plant: a clock that jumps does, for a while and in some
channels, what a friction does. By the noise such amplitudes are thousands of sigmas off zero. But a law that is there
asks for the same size in every window of every channel, and what stands in asks for as much more here as for less
there. With d what the law does, whitened, less what all other numbers take up of it, e what is left over, and parts
b = windows x channels, the size s of the law, 1 as it was fitted, changes by leaving a part out, and varies, by

    s - s_b = d_b^T e_b / (d^T d - d_b^T d_b),   sigma^2 = sum_b (s - s_b)^2.

Where e is noise, sigma^-2 is d^T d, as far as there are parts enough to tell: the square of the law's distance. What
lies within a single part is known by nothing.
Source: B. Efron, The jackknife, the bootstrap and other resampling plans (SIAM, 1982), chapter 3; J. G. MacKinnon, H.
    White, Some heteroskedasticity-consistent covariance matrix estimators, J. Econometrics 29 (1985) 305.
Validity: windows longer than what is left over is correlated for: a resonance's ringing decays in 3 s. Those of
    recordings of less than two minutes are shorter than that of the port test.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from kbs_process.diagnosis.experiment import Experiment
from kbs_process.diagnosis.metric import Metric
from kbs_process.diagnosis.thresholds import WINDOW_S
from kbs_process.signals.records import Array

_FEWEST = 8  # windows of a recording, however short
_LEAST = 1e-12  # of what a law does, that the other parts show


def parts(experiment: Experiment, trial: int, metric: Metric, done: Array, left: Array) -> Array:
    """(2, parts) d_b^T e_b and d_b^T d_b of one trial, of whitened d (rows,) `done` by a law and e (rows,) `left`."""
    n = len(experiment.trials[trial].measured)
    count = min(n, max(_FEWEST, round(n * experiment.dt / WINDOW_S)))
    starts = np.linspace(0, n, count, endpoint=False).astype(np.intp)
    d, e = metric.in_time(done, n), metric.in_time(left, n)
    products = [np.add.reduceat(metric.share * d * one, starts, axis=0).ravel() for one in (e, d)]
    return np.asarray(products, dtype=np.float64)


def evenly(of_trials: Iterable[Array]) -> float:
    """By how many sigmas of a law's size, as the `parts` of all trials have it, it is off zero."""
    pull, done = np.concatenate(list(of_trials), axis=1)
    total = float(done.sum())
    if not total > 0.0:
        return 0.0
    moved = pull / np.maximum(total - done, _LEAST * total)
    return float(1.0 / np.sqrt(np.maximum(moved @ moved, 1e-300)))
