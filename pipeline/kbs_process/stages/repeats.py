"""By how much one repeat of a trajectory is later than another: recorders are started by hand."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from scipy.signal import fftconvolve

from kbs_process.signals.records import Array, Run, Signal

# Two runs repeat each other where their motions, shifted, differ by less than this part of the motion.
SAME_MOTION = 0.01
END = 40  # samples before the end of a part of a recording, which the filters to the working rate did not know
REFINEMENTS = 12


def motion_of(run: Run) -> Signal | None:
    """Return what tells when a run moved, on the working grid: the command, else the angle, else the rate."""
    return commanded(run) or run.angle or run.rate


def commanded(run: Run) -> Signal | None:
    """Return the commanded angles on the wrench's grid, linear between cycles; None without commands."""
    if run.command is None or run.wrench is None:
        return None
    grid = run.wrench
    names = tuple(name for name in run.command.channels if not name.endswith(".rate"))
    columns = [
        np.interp(grid.t, run.command.t, run.command.values[:, run.command.channels.index(name)]) for name in names
    ]
    return Signal(
        t0=grid.t0,
        dt=grid.dt,
        values=np.stack(columns, axis=1),
        channels=names,
        units=("rad",) * len(names),
        frame="joint",
        valid=grid.valid,
    )


def copies(runs: Sequence[Run]) -> dict[int, int]:
    """Return which of the runs have the readings of one before them, or begin with them, and of which."""
    found: dict[int, int] = {}
    for (first, one), (second, other) in itertools.combinations(enumerate(runs), 2):
        a, b = one.loads, other.loads
        if a is None or b is None:
            continue
        both = min(len(a), len(b)) - (END if len(a) != len(b) else 0)
        if both > 0 and np.array_equal(a.values[:both], b.values[:both]):
            found.setdefault(second, first)
    return found


def lag(reference: Signal, other: Signal) -> float | None:
    """Return the time by which `other` moves later than `reference`, s; None where it does not repeat it.

    The maximum of the correlation of rates gives the lag to a sample, Gauss-Newton steps on the positions
    the rest: motions of degrees against commands good to microradians leave well below a millisecond.
    """
    a, b = (np.gradient(signal.values, signal.dt, axis=0) for signal in (reference, other))
    correlation = np.sum(fftconvolve(b, a[::-1], axes=0), axis=1)
    shift = float(np.argmax(correlation) - (len(a) - 1)) * reference.dt + other.t0 - reference.t0
    spread = float(np.sqrt(np.mean(np.var(reference.values, axis=0))))
    if spread == 0.0:
        return None
    residual = np.inf
    for _ in range(REFINEMENTS):
        t, target, moved, slope = _overlap(reference, other, shift)
        if len(t) < len(reference) // 2:
            return None
        difference = moved - target
        residual = float(np.sqrt(np.mean(difference**2)))
        power = float(np.sum(slope**2))
        if power == 0.0:
            return None
        step = float(np.sum(slope * difference)) / power
        shift -= step
        if abs(step) < 1e-9:
            break
    return shift if residual < SAME_MOTION * spread else None


def _overlap(reference: Signal, other: Signal, shift: float) -> tuple[Array, Array, Array, Array]:
    """Times, reference, the other at times + shift and its slope there, (n,), (n, c), over common times."""
    t = reference.t
    inside = (t + shift >= other.t[0]) & (t + shift <= other.t[-1])
    t = t[inside]
    at = [np.interp(t + shift, other.t, column) for column in other.values.T]
    slopes = np.gradient(other.values, other.dt, axis=0)
    slope = [np.interp(t + shift, other.t, column) for column in slopes.T]
    return t, reference.values[inside], np.stack(at, axis=1), np.stack(slope, axis=1)
