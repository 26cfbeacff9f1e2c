r"""How well amplitudes are known where more is left over than noise: by the scatter of what each part asks for.

A law with free amplitudes follows whatever was left out of the plant: a clock that jumps does, for a while and in some
channels, what a friction does. By the noise such amplitudes are thousands of sigmas off zero. But a law that is there
asks for the same size in every window of every channel, and what stands in asks for as much more here as for less
there. With S the whitened signature, less what all other numbers take up of it, e what is left over, and parts
b = windows x channels,

    C = (S^T S)^{-1}  (sum_b g_b g_b^T)  (S^T S)^{-1},   g_b = S_b^T e_b.

Where e is noise, that is the noise's covariance (S^T S)^{-1}, as far as there are parts enough to tell.
Source: K.-Y. Liang, S. L. Zeger, Longitudinal data analysis using generalized linear models, Biometrika 73 (1986) 13;
    H. White, A heteroskedasticity-consistent covariance matrix estimator, Econometrica 48 (1980) 817.
Validity: windows longer than what is left over is correlated for (a resonance's ringing decays in 3 s), and signatures
    that are spread over several parts: of one that lies within a single part this says too little.
"""

from __future__ import annotations

import numpy as np

from kbs_process.diagnosis.experiment import Experiment
from kbs_process.diagnosis.metric import Metric
from kbs_process.diagnosis.thresholds import WINDOW_S
from kbs_process.signals.records import Array


def scatter(experiment: Experiment, trial: int, metric: Metric, left: Array, directions: Array) -> Array:
    """(m, m) sum over a trial's parts of what each asks for: D_b^T e_b of whitened e (rows,) `left`, D (rows, m)."""
    n = len(experiment.trials[trial].measured)
    e = metric.share * metric.in_time(left, n)
    count = max(1, round(n * experiment.dt / WINDOW_S))
    starts = np.linspace(0, n, count, endpoint=False).astype(np.intp)
    pulls = [np.add.reduceat(e * metric.in_time(one, n), starts, axis=0).ravel() for one in directions.T]
    return np.asarray(np.array(pulls) @ np.array(pulls).T, dtype=np.float64)
