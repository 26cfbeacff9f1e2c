"""How the clocks of two loggers stand to each other, found from what the recordings share."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.signal import savgol_filter

from kbs_process.signals.records import Array, Mask

_POINTS = 1000  # of a recording, in the search
_MOST = 20 * _POINTS  # shifts; one recording that lasts so much longer than the other takes too long to search
_EXPLAINED = 0.05  # share of a channel that may be left, or angles do not tell its static part
_FEWEST = 30  # rows with a partner, fewer of which any curve fits
_BRIDGED = 10.0  # times their usual interval, or change: angles that are farther apart tell nothing of what is between
_PIECE = 0.1  # of all rows, fewer of which between two leaps are no motion
_BEND = 11  # points, over which an acceleration is fitted
_DISTINCT = 4.0  # times more is left at any other shift


def find_shift(
    t: Array, wrench: Array, t_angle: Array, angle: Array, turns: Sequence[bool]
) -> tuple[float, float] | None:
    """Return what is to be added to the times t (n,) of a wrench (n, c), and its sigma, s; None if that is not clear.

    The static wrench is a function of the angles (m, j): of their sines and cosines where a joint `turns`, else of the
    way, and of these in pairs; without `turns`, of the numbers themselves (elements of a rotation matrix). At the
    right shift least of the wrench is left beside it, and beside what goes with the accelerations. Channels that tell
    it are weighed, and the sigma holds what they differ by. The search covers all shifts at which half of the shorter
    recording has a partner. Valid where motion does not repeat itself within these. Angles that leap there and back for
    less than a tenth of the rows are left out. None where times go back, or leap by
    as much as they take otherwise.
    """
    if min(len(t), len(t_angle)) < _FEWEST:
        return None
    zero = float(t_angle[0] - t[0])  # one may count from 1970
    t, t_angle = t - t[0], t_angle - t_angle[0]
    coarse = max(1, len(t) // _POINTS)
    rows = slice(None, len(t) // coarse * coarse)
    few = t[rows].reshape(-1, coarse).mean(1), wrench[rows].reshape(-1, coarse, wrench.shape[1]).mean(1)
    steps = np.diff(t_angle)
    if any(each.min() < 0.0 or 2.0 * each.max() > each.sum() for each in (steps, np.diff(t))):
        return None
    known = (steps <= _BRIDGED * np.median(steps)) & _between(angle)

    def left(shift: float, times: Array, loads: Array, moved: bool = False) -> tuple[Array, Array]:
        at = times + shift
        after = np.searchsorted(t_angle, at)
        inside = (at >= t_angle[0]) & (at <= t_angle[-1]) & known[after.clip(1, len(known)) - 1]
        if inside.sum() < _FEWEST:
            return loads[:0], np.ones(loads.shape[1])
        q = np.stack([np.interp(at[inside], t_angle, one) for one in angle.T])
        parts = [
            one
            for joint, turn in zip(q, turns, strict=bool(turns))
            for one in ((np.sin(joint), np.cos(joint)) if turn else (joint,))
        ]
        pairs = (a * b for i, a in enumerate(parts) for b in parts[:i])
        terms = [np.ones(inside.sum()), *(chain(parts, pairs) if turns else q)]
        if moved:
            bends = savgol_filter(q, _BEND, 2, deriv=2, mode="nearest")
            terms += [bend * by for bend in bends for by in (terms[0], *(parts if turns else ()))]
        design = np.stack(terms, axis=1)
        there = loads[inside] - loads[inside].mean(0)
        basis = np.linalg.qr(design)[0]
        residual = there - basis @ (basis.T @ there)
        return residual, (residual**2).sum(0) / np.maximum((there**2).sum(0), np.finfo(float).tiny)

    half = 0.5 * min(t[-1] - t[0], t_angle[-1] - t_angle[0])
    step = max(float(np.diff(few[0]).mean()), 2.0 * half / _POINTS)
    if not t[-1] - t[0] + t_angle[-1] - t_angle[0] < _MOST * step:
        return None
    shifts = np.arange(t_angle[0] - t[-1] + half, t_angle[-1] - t[0] - half, step)
    if len(shifts) < 3:
        return None
    shares = np.array([left(shift, *few)[1] for shift in shifts])
    best, channel = np.unravel_index(shares.argmin(), shares.shape)
    curve = shares[:, channel]
    low, high = best, best  # where the curve rises from its least value
    while low > 0 and curve[low - 1] > curve[low]:
        low -= 1
    while high < len(curve) - 1 and curve[high + 1] > curve[high]:
        high += 1
    others = np.delete(curve, slice(low, high + 1))
    if curve[best] > _EXPLAINED or low == high or (len(others) and others.min() < _DISTINCT * curve[best]):
        return None

    def least(channel: int) -> tuple[float, float]:
        """Where least of a channel is left, and the sigma of that by its noise alone."""

        def share(shift: float) -> float:
            return float(left(shift, *few, True)[1][channel])

        found = float(minimize_scalar(share, bounds=(shifts[best] - step, shifts[best] + step), method="bounded").x)
        residual = left(found, *few, True)[0][:, channel]
        near = float((residual[1:] * residual[:-1]).sum() / (residual**2).sum())  # neighbours that err alike
        bend = (share(found + step) - 2.0 * share(found) + share(found - step)) / step**2
        spread = 2.0 * share(found) / (max(bend, 1e-300) * len(residual)) * (1.0 + near) / max(1.0 - near, 1e-3)
        return found, float(np.sqrt(spread))

    found, sigma = np.array([least(one) for one in np.flatnonzero(shares[best] < _EXPLAINED).tolist()]).T
    weight = 1.0 / np.maximum(sigma, 1e-12) ** 2
    mean = float((weight * found).sum() / weight.sum())
    apart = float((weight * (found - mean) ** 2).sum()) / max(1, len(found) - 1)
    return zero + mean, float(np.sqrt(max(1.0, apart) / weight.sum()))


def _between(angle: Array) -> Mask:
    """Between which successive angles (m - 1,) a joint moves: not where one leaps, nor in what two leaps cut out."""
    leaps = np.zeros(len(angle) - 1, dtype=np.bool_)
    for changes in np.abs(np.diff(angle, axis=0)).T:
        if changes.any():
            leaps |= changes > _BRIDGED * np.quantile(changes[changes > 0.0], 0.99)
    piece = np.concatenate([[0], np.cumsum(leaps)])
    whole = np.bincount(piece)[piece] >= _PIECE * len(angle)
    return np.asarray(whole[1:] & whole[:-1] & ~leaps)
