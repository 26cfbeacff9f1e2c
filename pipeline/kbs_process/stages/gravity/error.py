"""What the gravity model's uncertainty becomes in a band: errors with a time history of their own."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from kbs_process.signals.records import Array, Mask
from kbs_process.stages.budget import Entry, Filter, from_shapes
from kbs_process.stages.gravity.model import GravityModel, Static, angle_slopes, derivatives
from kbs_process.stages.gravity.parameters import Index
from kbs_process.stages.gravity.taring import Taring
from kbs_process.stages.motion import Motion

ANGLES = "angles: encoder rounding and missed motion"
_POINTS = 1000  # of a recording at which the shapes are computed, linear in between
_SLOW = 0.1  # of a recording's greatest rate, below which a joint counts as at rest
_NEGLIGIBLE = 1e-6  # part of the greatest eigenvalue from which a direction is left out


@dataclass(frozen=True, slots=True, eq=False)
class Slopes:
    """Derivatives of the modelled wrench along a recording, at some of its samples."""

    at: Index  # (m,)
    by_parameters: Array  # (m, c, p)
    by_angles: Array  # (m, c, joints)

    @classmethod
    def of(cls, motion: Motion, model: GravityModel) -> Slopes:
        at = np.unique(np.linspace(0, len(motion) - 1, min(len(motion), _POINTS)).astype(np.int64))
        return cls(at, derivatives(motion, model, at), angle_slopes(motion, model, at))


def entries(
    motion: Motion, static: Static, model: GravityModel, slopes: Slopes, band: Filter
) -> tuple[Entry, Entry, Entry]:
    """Budget entries of the fitted parameters' covariance and of the angles' error, within a band.

    The static wrench errs by J L z with J its derivatives along the motion, L L^T the parameters' covariance and z
    independent of unit variance: every column of J L is one error with its own history, and is filtered as the
    signal is. The recording's own constant takes up the mean of these errors (`Taring.slope`); what its noise leaves
    is constant, and vanishes in a band without zero frequency. The angles' error goes the same way, (dW/dq) times the
    histories of the encoders' rounding; what the angles' source misses of the real motion counts in full, wherever in
    the band it lies, and all of it is taken to fall into the time in which the joints move. Entries are rms over
    that time or over the rest, whichever is larger.
    """
    in_motion = moving(motion)
    histories = _shapes(len(motion), model, slopes, static.taring)
    shapes = (static.wrench.derive(shape, "error of the gravity model") for shape in histories)
    parameters = from_shapes("gravity", "covariance of the fitted parameters", shapes, band, in_motion)
    constant = np.broadcast_to(static.taring.noise, static.wrench.values.shape)
    tared = from_shapes(
        "gravity",
        "taring: a constant to each recording",
        [static.wrench.derive(constant.copy(), "error of the taring")],
        band,
    )
    flat = slopes.by_angles.reshape(len(slopes.at), -1)
    slope = _whole(flat, slopes.at, len(motion)).reshape(len(motion), *slopes.by_angles.shape[1:])
    rounding = (
        static.wrench.derive(slope[:, :, joint] * history[:, None] / np.sqrt(len(motion.rounding)), "rounding")
        for phase in motion.rounding
        for joint, history in enumerate(phase.T)
    )
    rounded = from_shapes("gravity", "", rounding, band, in_motion).sigma
    share = np.mean(in_motion) if in_motion.any() else 1.0
    missed = np.sqrt(np.mean((slope * motion.missed) ** 2, axis=0).sum(axis=1) / share)
    angles = Entry("gravity", ANGLES, np.hypot(rounded, missed))
    return parameters, tared, angles


def moving(motion: Motion) -> Mask:
    """When (n,) any joint moves faster than a tenth of the recording's greatest rate."""
    rate = np.max(np.abs(motion.qd), axis=1)
    mask: Mask = rate > _SLOW * np.max(rate, initial=0.0)
    return mask


def _shapes(count: int, model: GravityModel, slopes: Slopes, taring: Taring) -> Iterator[Array]:
    """One-sigma error histories (n, c) of independent directions of the rig's fitted parameters; none fitted: zero."""
    size = model.equation.size
    if size == 0:
        yield np.zeros((count, len(model.channels)))
        return
    J = slopes.by_parameters + taring.slope
    variance, directions = np.linalg.eigh(model.fit.covariance[:size, :size])
    for root, direction in zip(np.sqrt(np.maximum(variance, 0.0)), directions.T, strict=True):
        if root**2 > _NEGLIGIBLE * variance[-1]:
            yield _whole(J @ direction * root, slopes.at, count)


def _whole(sparse: Array, at: Index, count: int) -> Array:
    """All `count` samples of what is known `at` some (m, c), by straight lines."""
    return np.stack([np.interp(np.arange(count), at, column) for column in sparse.T], axis=1)
