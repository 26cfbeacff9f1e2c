"""Clocks whose stamps are late, exactly: what a stream reads then, and what it would have read without.

To first order a reading that is late by tau changes by -tau dy/dt. That holds as long as tau is far below a period, and
at the resonance of a transducer, 5 to 8 Hz, few clocks that are wrong are as near as that.
"""

from __future__ import annotations

import numpy as np

from kbs_process.signals.records import Array, Mask
from kbs_process.stages.align.condense import DOUBT
from kbs_process.stages.align.resample import Reducer, design

_PASSES = 4  # of the time at which a stamp was due
# s, that a clock may be late by and no first order tells: nearer to each other than a third of a period of what rings.
_FAR = (0.01, 0.025, 0.045, 0.07, 0.1, 0.14, 0.19, 0.25, 0.31, 0.37, 0.43, 0.49, 0.55, 0.61)
SIZES = (*(-one for one in reversed(_FAR)), *_FAR)
_DIFFERENCE = 1e-3  # s, for slopes: far below a period of the working band


def between(values: Array, valid: Mask, dt: float, own: Array) -> tuple[Array, Mask]:
    """Values (n, k), `dt` s apart, at times `own` (m,) s from the first, and where they are all there.

    By the interpolation that made the working rate; exact in its band.
    """
    reducer = Reducer(design(1.0 / dt, 1.0 / dt))
    reducer.push(values, None if valid.all() else ~valid)
    kept = reducer.finish()
    if kept is None:
        raise ValueError(f"{len(values)} samples are too few to be interpolated")
    moved, doubt = kept.at(own)
    inside = (own >= 0.0) & (own <= dt * (len(values) - 1)) & (doubt <= DOUBT)
    return moved, inside


def late_by(reading: Array, dt: float, late: Array) -> Array:
    """Change (n, c) of a reading (n, c) whose stamps are late by (n,) s; beyond its ends it rests."""
    n = len(reading)
    t = dt * np.arange(n)
    at = np.clip(np.concatenate([t - late, t]), 0.0, t[-1])
    read, right = np.split(between(reading, np.ones(n, dtype=np.bool_), dt, at)[0], 2)
    return np.asarray(read - right, dtype=np.float64)


def slope(reading: Array, dt: float) -> Array:
    """(n, c) time derivative of a reading (n, c), right in the working band but for its first and last samples."""
    t = dt * np.arange(len(reading))
    at = np.concatenate([t + _DIFFERENCE, t - _DIFFERENCE])
    after, before = np.split(between(reading, np.ones(len(reading), dtype=np.bool_), dt, at)[0], 2)
    return np.asarray((after - before) / (2.0 * _DIFFERENCE), dtype=np.float64)


def set_right(measured: Array, valid: Mask, dt: float, late: Array) -> tuple[Array, Mask]:
    """What a stream (n, c) would have read at its stamps by a clock that is right, and where that is known.

    `late` (n,) is by how many s each stamp is late: what was due at t is stamped s = t + late(s).
    """
    t = dt * np.arange(len(measured))
    stamp = t
    for _ in range(_PASSES):
        stamp = t + np.interp(stamp, t, late)
    return between(measured, valid, dt, np.asarray(stamp, dtype=np.float64))
