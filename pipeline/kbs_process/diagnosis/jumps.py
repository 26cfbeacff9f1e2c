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

    What is left of a reading y that is late by tau is -tau dy/dt. With one tau before t0 and another after it,

        gain(t0) = N1^2/D1 + N2^2/D2 - (N1 + N2)^2/(D1 + D2),   N = sum e y', D = sum y'^2

    over the samples of either side, channels weighted by their noise, summed over the recordings of the trajectory.
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
    if shown.shape[1] == 0:
        return np.zeros(len(places))
    weight = 1.0 / np.maximum(np.var(np.diff(error[valid], axis=0), axis=0), 1e-300)
    rate = np.gradient(shown, axis=0) * valid[:, None]
    N = np.concatenate([[0.0], np.cumsum((error * rate) @ weight)])
    D = np.concatenate([[0.0], np.cumsum(rate**2 @ weight)])
    if not D[-1] > 0.0:
        return np.zeros(len(places))
    at = places.astype(np.intp)
    least = 1e-9 * D[-1]
    before, after = np.maximum(D[at], least), np.maximum(D[-1] - D[at], least)
    return np.asarray(N[at] ** 2 / before + (N[-1] - N[at]) ** 2 / after - N[-1] ** 2 / D[-1])
