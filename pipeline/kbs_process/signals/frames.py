"""Rotations, vectorised over leading axes. `R_GT` maps the components of a vector from T's axes into G's.

Stacks of matrices made here lie in memory with the leading axis innermost, along which `chain` and `rotate` then run:
several times faster than matrix by matrix.
"""

from __future__ import annotations

import numpy as np

from kbs_process.signals.records import Array


def skew(a: Array) -> Array:
    """Matrix of the cross product: skew(a) @ b = a x b; (..., 3) -> (..., 3, 3)."""
    a = np.asarray(a, dtype=float)
    S = np.zeros((*a.shape[:-1], 3, 3))
    S[..., 0, 1], S[..., 0, 2] = -a[..., 2], a[..., 1]
    S[..., 1, 0], S[..., 1, 2] = a[..., 2], -a[..., 0]
    S[..., 2, 0], S[..., 2, 1] = -a[..., 1], a[..., 0]
    return S


def about_axis(axis: Array, angle: Array | float) -> Array:
    """R_PC of a link C that turned by `angle` (...) rad about the unit vector `axis` (3,) of its parent P.

    Rodrigues: R = I + sin(q) S + (1 - cos(q)) S^2, S = skew(axis).
    """
    S = skew(np.asarray(axis, dtype=float))
    q = np.asarray(angle, dtype=float)
    sine, versine = np.sin(q), 2.0 * np.sin(q / 2.0) ** 2
    R: Array = np.eye(3) + _times(sine, S) + _times(versine, S @ S)
    return R


def from_rotation_vector(phi: Array) -> Array:
    """Rotation by |phi| rad about phi / |phi|; (..., 3) -> (..., 3, 3); exact down to |phi| = 0."""
    phi = np.asarray(phi, dtype=float)
    angle = np.linalg.norm(phi, axis=-1)[..., None, None]
    S = skew(phi)
    R: Array = np.eye(3) + np.sinc(angle / np.pi) * S + 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2 * (S @ S)
    return R


def from_tilt(tilt: Array) -> Array:
    """R_LT of a transducer inclined by tilt = (tx about x, ty about y), rad: R_y(ty) R_x(tx).

    Gravity in T is then g (sin ty, -sin tx cos ty, -cos tx cos ty).
    """
    tx, ty = np.asarray(tilt, dtype=float)
    return about_axis(np.array([0.0, 1.0, 0.0]), ty) @ about_axis(np.array([1.0, 0.0, 0.0]), tx)


def from_xyz(angles: Array) -> Array:
    """Turns about x, then about the new y, then about the new z: R_x(a) R_y(b) R_z(c); (..., 3) rad."""
    a = np.asarray(angles, dtype=float)
    x, y, z = np.eye(3)
    R: Array = about_axis(x, a[..., 0]) @ about_axis(y, a[..., 1]) @ about_axis(z, a[..., 2])
    return R


def into_xyz(angles: Array, a: Array) -> Array:
    """from_xyz(angles)^T @ a: components, after these turns, of vectors given before them, (..., 3) each."""
    c, s = np.cos(angles), np.sin(angles)
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    y, z = c[..., 0] * y + s[..., 0] * z, c[..., 0] * z - s[..., 0] * y
    x, z = c[..., 1] * x - s[..., 1] * z, c[..., 1] * z + s[..., 1] * x
    x, y = c[..., 2] * x + s[..., 2] * y, c[..., 2] * y - s[..., 2] * x
    return _vector(x, y, z)


def chain(R: Array, S: Array) -> Array:
    """R @ S for stacks of matrices (..., 3, 3)."""
    RS: Array = np.einsum("...ij,...jk->...ik", R, S, order="F")
    return RS


def rotate(R: Array, a: Array) -> Array:
    """R @ a for stacks of matrices (..., 3, 3) and vectors (..., 3)."""
    b: Array = np.einsum("...ij,...j->...i", R, a, order="F")
    return b


def cross(a: Array, b: Array) -> Array:
    """a x b over the last axis, broadcasting; several times faster than numpy's general one."""
    a0, a1, a2 = a[..., 0], a[..., 1], a[..., 2]
    b0, b1, b2 = b[..., 0], b[..., 1], b[..., 2]
    return _vector(a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0)


def _vector(x: Array, y: Array, z: Array) -> Array:
    a: Array = np.einsum("i...->...i", np.array([x, y, z]))
    return a


def _times(a: Array, S: Array) -> Array:
    product: Array = np.einsum("...,ij->...ij", a, S, order="F")
    return product
