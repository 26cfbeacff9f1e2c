"""What differs from trial to trial and is no one's mismatch: zeros, their drift, the clocks, what rang before."""

from __future__ import annotations

import numpy as np

from kbs_process.diagnosis.experiments.experiment import Experiment, Trial
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, Prediction
from kbs_process.diagnosis.experiments.ringing import decays
from kbs_process.diagnosis.experiments.stamps import slope
from kbs_process.signals.records import Array


def unknown_terms(experiment: Experiment) -> tuple[int, ...]:
    """Of each channel, how many of a constant and a slope: both of a load with a bias, the first of an angle."""
    rig = experiment.rig
    tared = rig.loads.bias_sigma[rig.loads.index(rig.channels)] > 0.0
    return (*(2 if one else 0 for one in tared), *[1] * (len(experiment.channels) - experiment.loads))


def nuisances(
    experiment: Experiment, trial: Trial, prediction: Prediction, hypothesis: Hypothesis
) -> tuple[Array, Array]:
    """Columns (n, c, k) and one over their standard deviations (k,), 0 where nothing is known of them.

    A constant and a slope of each load channel with a bias (taring and drift), a constant of each angle, the residual
    error of the wrench's and the encoders' clocks, one s each, first order in it, and what rings at the beginning.
    """
    n, c = prediction.values.shape
    wrench = experiment.loads
    t = np.linspace(-1.0, 1.0, n)
    columns, precision = [np.zeros((n, c))], [1.0]  # none, where there are no others
    for channel, terms in enumerate(unknown_terms(experiment)):
        for shape in (np.ones(n), t)[:terms]:
            column = np.zeros((n, c))
            column[:, channel] = shape
            columns.append(column)
            precision.append(0.0)
    late = slope(prediction.values, experiment.dt)
    for channels, sigma in ((slice(0, wrench), trial.wrench_clock_sigma), (slice(wrench, c), trial.angle_clock_sigma)):
        if sigma > 0.0 and channels.start < c:
            column = np.zeros((n, c))
            column[:, channels] = late[:, channels]
            columns.append(column)
            precision.append(1.0 / sigma)
    begin = int(np.argmax(trial.valid))
    ringing = decays(experiment, hypothesis, trial.drive, begin, n)
    whole = np.concatenate([np.stack(columns, axis=2), ringing], axis=2)
    return whole, np.array([*precision, *[0.0] * ringing.shape[2]])
