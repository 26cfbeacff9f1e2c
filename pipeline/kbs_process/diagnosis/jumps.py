"""Where the clock of a stream seems to jump: the time before and after which readings are late by different amounts."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from kbs_process.diagnosis.hypothesis import Prediction
from kbs_process.diagnosis.known import Known
from kbs_process.signals.records import Array, Mask

_PLACES = 400  # that the longest recording is divided into
_EDGE = 0.02  # of a recording, at either end, in which a jump shows too little


def jumps(known: Known, predicted: Mapping[int, Prediction]) -> dict[str, float]:
    """Return the likeliest time of one jump, s, of the streams of wrench and encoders; none where they do not move.

    `predicted` are the readings by drive.

    What is left of a reading y that is late by tau is -tau dy/dt. With one tau before t0 and another after it,

        gain(t0) = N1^2/D1 + N2^2/D2 - (N1 + N2)^2/(D1 + D2),   N = sum e y', D = sum y'^2

    over the samples of either side, channels weighted by their noise, summed over the recordings that are fitted.
    """
    experiment = known.experiment
    longest = max(len(experiment.trials[k].valid) for k in experiment.fit) * experiment.dt
    times = np.linspace(_EDGE, 1.0 - _EDGE, _PLACES) * longest
    streams = {"wrench": slice(0, experiment.wrench_channels), "encoder": slice(experiment.loads, None)}
    found = {}
    for stream, channels in streams.items():
        gain = np.zeros(_PLACES)
        for k in experiment.fit:
            trial = experiment.trials[k]
            shown = predicted[trial.drive].values[:, channels]
            gain += _gain(trial.measured[:, channels] - shown, shown, trial.valid, times / experiment.dt)
        if gain.max() > 0.0:
            found[stream] = float(times[np.argmax(gain)])
    return found


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
    at = np.minimum(places.astype(np.intp), len(error))
    least = 1e-9 * D[-1]
    before, after = np.maximum(D[at], least), np.maximum(D[-1] - D[at], least)
    return np.asarray(N[at] ** 2 / before + (N[-1] - N[at]) ** 2 / after - N[-1] ** 2 / D[-1])
