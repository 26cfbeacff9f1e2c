r"""How well amplitudes are known where more is left over than noise: by the scatter of what each part asks for.

A law with free amplitudes follows whatever was left out of the plant: a clock that jumps does, for a while and in some
channels, what a friction does. By the noise such amplitudes are thousands of sigmas off zero. But a law that is there
asks for the same size in every window of every channel, and what stands in asks for as much more here as for less
there. With S the whitened signature, less what all other numbers take up of it, C = (S^T S)^{-1}, e what is left over,
and parts b = windows x channels, amplitudes change by leaving a part out, and vary, by

    a - a_b = (C^{-1} - S_b^T S_b)^{-1} S_b^T e_b,   V = sum_b (a - a_b) (a - a_b)^T.

Where e is noise, V is C, as far as there are parts enough to tell. What lies within a single part is known by nothing.
Source: B. Efron, The jackknife, the bootstrap and other resampling plans (SIAM, 1982), chapter 3; J. G. MacKinnon, H.
    White, Some heteroskedasticity-consistent covariance matrix estimators, J. Econometrics 29 (1985) 305.
Validity: windows longer than what is left over is correlated for: a resonance's ringing decays in 3 s.
"""

from __future__ import annotations

import numpy as np

from kbs_process.diagnosis.experiment import Experiment
from kbs_process.diagnosis.metric import Metric
from kbs_process.diagnosis.thresholds import WINDOW_S
from kbs_process.signals.records import Array

_ALIKE = 1e-9  # of correlations: combinations of amplitudes that are one and the same


def scatter(
    experiment: Experiment, trial: int, metric: Metric, left: Array, directions: Array, C: Array
) -> Array:
    """(m, m) sum over a trial's parts of squares of (a - a_b), of whitened e (rows,) `left` and S C (rows, m).

    C (m, m) is the covariance by the noise, over all trials from which amplitudes are.
    """
    n = len(experiment.trials[trial].measured)
    count = max(1, round(n * experiment.dt / WINDOW_S))
    starts = np.linspace(0, n, count, endpoint=False).astype(np.intp)
    size = 1.0 / np.sqrt(np.maximum(np.diag(C), 1e-300))  # amplitudes come in units of any size
    e = metric.share * metric.in_time(left, n)
    D = np.stack([metric.in_time(one, n) for one in (directions * size).T], axis=2)
    pulls = np.add.reduceat(e[:, :, None] * D, starts, axis=0).reshape(-1, len(C))
    D *= np.sqrt(metric.share)[:, None]
    products = np.stack(
        [np.add.reduceat(D * D[:, :, k, None], starts, axis=0) for k in range(len(C))], axis=3
    )
    inverse = np.linalg.pinv(C * np.outer(size, size), rcond=_ALIKE, hermitian=True)
    others = np.eye(len(C)) - products.reshape(-1, len(C), len(C)) @ inverse
    # A direction that one part alone shows is known by no other.
    others += _ALIKE * np.eye(len(C))
    moved = np.linalg.solve(others, pulls[:, :, None])[:, :, 0] / size
    return np.asarray(moved.T @ moved, dtype=np.float64)
