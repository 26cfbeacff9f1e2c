"""Where the clock of a stream seems to jump: the time before and after which readings are late by different amounts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.floor import channel_windows
from kbs_process.diagnosis.experiments.hypothesis import Prediction
from kbs_process.diagnosis.experiments.stamps import SIZES, late_by, slope
from kbs_process.signals.records import Array, Mask

PLACES = 400  # that a recording is divided into
_EDGE = 0.02  # of a recording, at either end, in which a jump shows too little
_FEWEST = 8  # samples, of which a channel says something
_LEAST = 1e-9  # of what a delay does all along, that a jump does beside it

_Telling = tuple[int, NDArray[np.intp], float, Array]


def jump(experiment: Experiment, predicted: Mapping[int, Prediction], trajectory: int, stream: str) -> float:
    """Return the likeliest time of one jump along a trajectory, s, of the clock of wrench or encoder.

    `predicted` are the readings by drive; recordings that are held out say nothing, where others are not. Amid a
    trajectory along which nothing moves.

    What is left of a reading y that is late by tau is b + c t - tau dy/dt, with a bias and its drift. The gain of t0 is
    what one tau before it and another after it take of the squares of what is left beyond what one tau for all takes:
    least squares, channels weighted by their noise, summed over the recordings of the trajectory. Of a jump by a good
    part of a period that says little: `SIZES` of it are tried as such, if one does more.
    """
    own = [trial for trial in experiment.trials if trial.trajectory == trajectory]
    own = [trial for trial in own if trial.role != "held-out"] or own
    channels = slice(0, experiment.loads) if stream == "wrench" else slice(experiment.loads, None)
    places = np.linspace(_EDGE, 1.0 - _EDGE, PLACES) * len(own[0].valid)
    gain, far = np.zeros(PLACES), np.zeros((len(SIZES), PLACES))
    for trial in own:
        shown = predicted[trial.drive].values[:, channels]
        there = channel_windows(experiment, trial, trial.valid)[:, channels] > 0.0
        rate = slope(shown, experiment.dt)
        error = trial.measured[:, channels] - shown
        telling = list(_telling(error, there))
        gain += _gain(error, rate, telling, places)
        for k, size in enumerate(SIZES):
            change = late_by(shown, experiment.dt, np.full(len(shown), size))
            far[k] += _relief(error, change, telling, places)
    # At the first place it is nearly all of a recording that is late: no jump.
    gain = np.maximum(gain, far.max(axis=0) - max(0.0, float(far[:, 0].max())))
    best = int(np.argmax(gain)) if gain.max() > 0.0 else PLACES // 2
    return float(places[best] * experiment.dt)


def _gain(error: Array, rates: Array, telling: Sequence[_Telling], places: Array) -> Array:
    """(m,) what a jump at each of some places, in samples, takes of an error (n, c) of readings that change at `rates`.

    Of channels that are `telling`.
    """
    sums = np.zeros((5, len(places)))
    for channel, at, noise, drift in telling:
        e, rate = error[at, channel], rates[at, channel]
        left = e - drift @ (drift.T @ e)
        after = np.searchsorted(at, places)
        r2, er, u = (_after(one, after) for one in (rate**2, left * rate, drift * rate[:, None]))
        all_u = drift.T @ rate
        own = rate @ rate - all_u @ all_u, r2 - np.sum(u**2, axis=1), r2 - u @ all_u, left @ rate, er
        sums += np.stack(np.broadcast_arrays(*own)) / noise
    whole, later, overlap, pull, of_later = sums
    if not whole[0] > 0.0:
        return np.zeros(len(places))
    # What a change after the place takes beside one tau for all.
    beside = later - overlap**2 / whole
    return np.asarray((of_later - overlap * pull / whole) ** 2 / np.maximum(beside, _LEAST * whole))


def _relief(error: Array, change: Array, telling: Sequence[_Telling], places: Array) -> Array:
    """(m,) by how much squares of an error (n, c), beside a bias and its drift, fall by a change from each place on."""
    total = np.zeros(len(places))
    for channel, at, noise, drift in telling:
        e = error[at, channel]
        plain, less = (one - drift @ (drift.T @ one) for one in (e, e - change[at, channel]))
        total += _after(plain**2 - less**2, np.searchsorted(at, places)) / noise
    return total


def _telling(error: Array, there: Mask) -> Iterator[_Telling]:
    """Channels of an error (n, c) that say something: which, samples, variance of noise, (m, 2) a bias and its drift.

    `there` (n, c) is where one does.
    """
    for channel, (e, valid) in enumerate(zip(error.T, there.T, strict=True)):
        at = np.flatnonzero(valid)
        noise = float(np.var(np.diff(e[at]))) if len(at) > _FEWEST else 0.0
        if noise > 0.0:
            yield channel, at, noise, np.linalg.qr(np.stack([np.ones(len(at)), at - at.mean()], axis=1))[0]


def _after(series: Array, places: NDArray[np.intp]) -> Array:
    """Sums of (n, ...) from each place on, (m, ...)."""
    total = np.concatenate([np.zeros_like(series[:1]), np.cumsum(series, axis=0)])
    return np.asarray(total[-1] - total[places])
