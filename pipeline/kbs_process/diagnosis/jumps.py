"""Where the clock of a stream seems to jump: the time before and after which readings are late by different amounts."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from kbs_process.diagnosis.experiment import Experiment
from kbs_process.diagnosis.hypothesis import Prediction
from kbs_process.signals.records import Array, Mask

_PLACES = 400  # that a recording is divided into
_EDGE = 0.02  # of a recording, at either end, in which a jump shows too little


def jump(experiment: Experiment, predicted: Mapping[int, Prediction], trajectory: int, stream: str) -> float:
    """Return the likeliest time of one jump along a trajectory, s, of the clock of wrench or encoder.

    `predicted` are the readings by drive; recordings that are held out say nothing, where others are not. Amid a
    trajectory along which nothing moves.

    What is left of a reading y that is late by tau is b - tau dy/dt, b the channel's bias. The gain of t0 is what one
    tau before it and another after it take of the squares of what is left beyond what one tau for all takes: least
    squares, the biases taken out, channels weighted by their noise, summed over the recordings of the trajectory.
    """
    own = [trial for trial in experiment.trials if trial.trajectory == trajectory]
    own = [trial for trial in own if trial.role != "held-out"] or own
    channels = slice(0, experiment.wrench_channels) if stream == "wrench" else slice(experiment.loads, None)
    places = np.linspace(_EDGE, 1.0 - _EDGE, _PLACES) * len(own[0].valid)
    gain = np.zeros(_PLACES)
    for trial in own:
        shown = predicted[trial.drive].values[:, channels]
        gain += _gain(trial.measured[:, channels] - shown, shown, trial.valid, places)
    best = int(np.argmax(gain)) if gain.max() > 0.0 else _PLACES // 2
    return float(places[best] * experiment.dt)


def _gain(error: Array, shown: Array, valid: Mask, places: Array) -> Array:
    """(m,) what a jump at each of some places, in samples, takes of an error (n, c) of readings as they are `shown`."""
    e, rate = error[valid], np.gradient(shown, axis=0)[valid]
    if shown.shape[1] == 0 or len(e) < 2:
        return np.zeros(len(places))
    weight = 1.0 / np.maximum(np.var(np.diff(e, axis=0), axis=0), 1e-300)
    at = np.searchsorted(np.flatnonzero(valid), places)
    N, D, mean = (
        np.vstack([np.zeros(rate.shape[1]), np.cumsum(one, axis=0)])
        for one in ((e - e.mean(axis=0)) * rate, rate**2, rate)
    )
    before, after = mean[at], mean[-1] - mean[at]
    n1, n2 = N[at] @ weight, (N[-1] - N[at]) @ weight
    d1, d2 = (D[at] - before**2 / len(e)) @ weight, (D[-1] - D[at] - after**2 / len(e)) @ weight
    across = -(before * after / len(e)) @ weight
    least = 1e-9 * float(D[-1] @ weight)
    if not least > 0.0:
        return np.zeros(len(places))
    d1, d2 = np.maximum(d1, least), np.maximum(d2, least)
    two = (n1**2 * d2 - 2.0 * n1 * n2 * across + n2**2 * d1) / np.maximum(d1 * d2 - across**2, least**2)
    return np.asarray(two - (n1 + n2) ** 2 / np.maximum(d1 + 2.0 * across + d2, least))
