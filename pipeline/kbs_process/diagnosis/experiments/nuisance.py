"""What differs from trial to trial and is no one's mismatch: zeros, their drift, the clocks, what rang before."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from kbs_process.diagnosis.experiments.experiment import Experiment, Trial
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, Prediction, acting, coupled
from kbs_process.diagnosis.experiments.stamps import slope
from kbs_process.plant.laws import select
from kbs_process.plant.linear.linearise import linearise
from kbs_process.signals.records import Array

_GROWS = 1e3  # times as much at a recording's end as at its beginning: no decay, where a gear pushes away from a pose


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


def decays(experiment: Experiment, hypothesis: Hypothesis, drive: int, begin: int, n: int) -> Array:
    r"""Return free decays from sample `begin` on, (n, c, 6): zero before it; none (n, c, 0) of a rigid transducer.

    Nor of an article that runs away from its pose. What still rings when a recording begins are free decays of the
    elastic transducer under the article,

        x'' = -M^{-1} (C x' + K x),   wrench = (G + D d/dt - L d^2/dt^2) x

    from unit angles and unit rates of the plate about its three axes. What set it going came before the recording, and
    no model of the article explains it: a mechanism that was switched on a moment ago rings, and one whose controller
    corrected an error at its start.

    Validity: small angles about the pose at the drive's beginning; the amplifier's lag, which only mixes a mode's two
    columns, is left out.
    """
    schedule = experiment.drives[drive].schedule
    c = len(experiment.channels)
    if schedule is None or hypothesis.rig.transducer.stiffness is None:
        return np.zeros((n, c, 0))
    # Friction of a rotor at rest has slopes of either sign; what rings is held by motors and gears.
    held = [
        effect
        for effect in select(acting(hypothesis, experiment.drives[drive]))
        if not effect.port.of_rotor or "field" in effect.arguments
    ]
    system = linearise(hypothesis.rig, held, schedule.position[0])
    size = len(system.M)
    inverse = np.linalg.inv(system.M)
    A = np.zeros((2 * size, 2 * size))
    A[:size, size:] = np.eye(size)
    A[size:] = np.hstack([-inverse @ system.K, -inverse @ system.C])
    step = expm(A * experiment.dt)
    fastest = float(np.abs(np.linalg.eigvals(step)).max())
    if (n - begin) * np.log(fastest) > np.log(_GROWS):
        return np.zeros((n, c, 0))
    state = np.zeros((2 * size, 2 * system.plate))
    for k in range(system.plate):
        state[k, k] = state[size + k, system.plate + k] = 1.0
    rows = np.hstack([system.gravity, system.drag]) - system.momentum @ A[size:]
    outs = [system.output(name) for name in experiment.channels[experiment.loads :]]
    wrench, angles = np.zeros((n, 6, 2 * system.plate)), np.zeros((n, len(outs), 2 * system.plate))
    for sample in range(begin, n):
        wrench[sample], angles[sample] = rows @ state, state[outs]
        state = step @ state
    read = coupled(hypothesis.rig, experiment, np.eye(6)).T
    return np.concatenate([np.einsum("cw,nwk->nck", read, wrench), angles], axis=1)
