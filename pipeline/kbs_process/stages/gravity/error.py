"""What the gravity model's uncertainty becomes in a band: errors with a time history of their own."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kbs_process.signals.records import Array, Mask
from kbs_process.stages.budget import Entry, Filter, from_shapes
from kbs_process.stages.gravity.model import GravityModel, Static, angle_slopes, derivatives
from kbs_process.stages.gravity.parameters import Index
from kbs_process.stages.gravity.taring import Taring
from kbs_process.stages.motion import Motion

_POINTS = 1000  # of a recording at which the shapes are computed, linear in between
_SLOW = 0.1  # of a recording's greatest rate, below which a joint counts as at rest
_NEGLIGIBLE = 1e-6  # part of the greatest eigenvalue from which a direction is left out


def entries(motion: Motion, static: Static, model: GravityModel, band: Filter) -> tuple[Entry, Entry, Entry]:
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
    shapes = (
        static.wrench.derive(shape, "error of the gravity model") for shape in _shapes(motion, model, static.taring)
    )
    parameters = from_shapes("gravity", "covariance of the fitted parameters", shapes, band, in_motion)
    constant = np.broadcast_to(static.taring.noise, static.wrench.values.shape)
    tared = from_shapes(
        "gravity",
        "taring: a constant to each recording",
        [static.wrench.derive(constant.copy(), "error of the taring")],
        band,
    )
    slope = _slope(motion, model)
    rounding = (
        static.wrench.derive(slope[:, :, joint] * history[:, None] / np.sqrt(len(motion.rounding)), "rounding")
        for phase in motion.rounding
        for joint, history in enumerate(phase.T)
    )
    rounded = from_shapes("gravity", "", rounding, band, in_motion).sigma
    share = np.mean(in_motion) if in_motion.any() else 1.0
    missed = np.sqrt(np.mean((slope * motion.missed) ** 2, axis=0).sum(axis=1) / share)
    angles = Entry("gravity", "angles: encoder rounding and missed motion", np.hypot(rounded, missed))
    return parameters, tared, angles


def moving(motion: Motion) -> Mask:
    """When (n,) any joint moves faster than a tenth of the recording's greatest rate."""
    rate = np.max(np.abs(motion.qd), axis=1)
    mask: Mask = rate > _SLOW * np.max(rate, initial=0.0)
    return mask


def _slope(motion: Motion, model: GravityModel) -> Array:
    """dW/dq (n, c, joints) along the motion."""
    at = _sparse(motion)
    sparse = angle_slopes(motion, model, at)
    t = np.arange(len(motion))
    columns = [np.interp(t, at, column) for column in sparse.reshape(len(at), -1).T]
    return np.stack(columns, axis=1).reshape(len(motion), *sparse.shape[1:])


def _sparse(motion: Motion) -> Index:
    return np.unique(np.linspace(0, len(motion) - 1, min(len(motion), _POINTS)).astype(np.int64))


def _shapes(motion: Motion, model: GravityModel, taring: Taring) -> Iterator[Array]:
    """One-sigma error histories (n, c) of independent directions of the rig's fitted parameters; none fitted: zero."""
    at = _sparse(motion)
    size = model.equation.size
    if size == 0:
        yield np.zeros((len(motion), len(model.channels)))
        return
    J = derivatives(motion, model, at) + taring.slope
    variance, directions = np.linalg.eigh(model.fit.covariance[:size, :size])
    t = np.arange(len(motion))
    for root, direction in zip(np.sqrt(np.maximum(variance, 0.0)), directions.T, strict=True):
        if root**2 > _NEGLIGIBLE * variance[-1]:
            yield np.stack([np.interp(t, at, column) for column in (J @ direction * root).T], axis=1)
