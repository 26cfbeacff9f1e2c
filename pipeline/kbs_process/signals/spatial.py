"""Wrenches [F, M] carried from one frame to another.

A frame T is placed in a frame G by `R_GT` (maps T's components into G's) and `r_GT` (T's origin from G's
origin, in G's axes, m). A wrench's moment belongs to the origin of its frame.
"""

from __future__ import annotations

import numpy as np

from kbs_process.signals.frames import cross, rotate, skew
from kbs_process.signals.records import Array


def transform_wrench(wrench: Array, R_GT: Array, r_GT: Array) -> Array:
    """The same wrench about G's origin in G's axes: F' = R F, M' = R M + r x F'; (..., 6) N, N m."""
    force = rotate(R_GT, wrench[..., :3])
    moment = rotate(R_GT, wrench[..., 3:]) + cross(r_GT, force)
    return np.concatenate([force, moment], axis=-1)


def wrench_matrix(R_GT: Array, r_GT: Array) -> Array:
    """The 6 x 6 matrix of `transform_wrench`, for covariances and spectra."""
    X = np.zeros((6, 6))
    X[:3, :3] = X[3:, 3:] = R_GT
    X[3:, :3] = skew(r_GT) @ R_GT
    return X


def inverse_pose(R_GT: Array, r_GT: Array) -> tuple[Array, Array]:
    """R_TG and r_TG of the frames the other way round."""
    R_TG = np.swapaxes(R_GT, -1, -2)
    return R_TG, -rotate(R_TG, r_GT)
