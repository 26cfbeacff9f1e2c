"""Joint angles from the orientation of a link, as quaternions or rotation matrices have it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise

import msgspec
import numpy as np

from kbs_process.errors import ConfigError, RecordingError
from kbs_process.rig.model import TRANSDUCER, Rig
from kbs_process.signals.frames import about_axis, cross, from_rotation_vector, from_tilt, rotate, skew
from kbs_process.signals.records import Array, Mask

_UNEVEN = 0.01  # share by which the length of a quaternion, or the rows of a matrix, may be off
_OFF = np.radians(5.0)  # rms of what turns about no joint, beyond which the axes are others
_NEAR = np.radians(1.0)  # of axes that are parallel


class Orientation(msgspec.Struct, frozen=True):
    """Where the orientation of a link is, which joints make it up, and how it is written."""

    joints: tuple[str, ...]  # from the base outwards; the last one carries the link
    columns: tuple[int | str, ...]  # four: w, x, y, z; nine: a matrix row by row
    inverse: bool  # it maps vectors from the base into the link
    at_zero: tuple[float, ...]  # what it is where all joints are at zero; empty: no rotation

    @property
    def fields(self) -> tuple[str, ...]:
        """Places of the angles in messages."""
        return tuple(f"position[{name}]" for name in self.joints)


def axes_of(one: Orientation, rig: Rig, where: str) -> tuple[Array, Array]:
    """Return the joints' axes (k, 3), with all joints at zero, and the orientation (3, 3) then, in the base's axes.

    Raises ConfigError where these joints do not follow each other, or cannot be told apart.
    """
    names = rig.joint_names
    first = names.index(one.joints[0])
    if names[first : first + len(one.joints)] != one.joints:
        what = f"the joints {', '.join(one.joints)} do not carry each other in this order"
        raise ConfigError(what, where=where, remedy=f"the rig's are {', '.join(names)}, from the laboratory outwards")
    axes, R = [], np.eye(3)
    for place, joint in enumerate(map(rig.joint, one.joints)):
        tilt = from_tilt(rig.transducer.tilt.value) if place and joint.parent == TRANSDUCER else np.eye(3)
        R = R @ tilt @ from_rotation_vector(joint.misalignment.value)
        axes.append(R @ np.asarray(joint.axis))
    for a, b in pairwise(axes):
        if np.linalg.norm(np.cross(a, b)) < np.sin(_NEAR):
            what = (
                f"joints of {', '.join(one.joints)} turn about parallel axes: an orientation does not tell them apart"
            )
            raise ConfigError(what, where=where, remedy="give their angles in [encoder]")
    return np.array(axes), R


class Attitude:
    """Turns the orientations of one recording into continuous angles, a piece at a time, and judges them."""

    def __init__(self, one: Orientation, rig: Rig, where: str) -> None:
        self.orientation = one
        self._axes, home = axes_of(one, rig, where)
        self._home = home.T
        if one.at_zero:
            zero, good = _rotations(np.array([one.at_zero]), None)
            if not good[0]:
                raise ConfigError("at_zero is no rotation", where=where, remedy="copy four or nine numbers of the file")
            self._home = zero[0] if one.inverse else zero[0].T
        self._length: float | None = None  # of a quaternion
        self._last = np.full(len(one.joints), np.nan)
        self._side = 0.0  # which of two solutions three joints have
        self._count, self._lacking, self._squares, self._most = 0, 0, 0.0, 0.0

    def angles(self, cells: Array, where: str) -> Array:
        """Return the joints' angles (n, k), rad, of the numbers (n, 4) or (n, 9); NaN where these are no rotation."""
        if self._length is None and cells.shape[1] == 4 and np.isfinite(cells).all(1).any():
            self._length = float(np.nanmedian(np.linalg.norm(cells, axis=1)))
        R, good = _rotations(cells, self._length)
        R = (R[good].swapaxes(1, 2) if self.orientation.inverse else R[good]) @ self._home
        q = self._solved(R, where)
        made = np.broadcast_to(np.eye(3), R.shape)
        for axis, angle in zip(self._axes, q.T, strict=True):
            made = made @ about_axis(axis, angle)
        left = 2.0 * np.arcsin(np.minimum(np.linalg.norm(R - made, axis=(1, 2)) / np.sqrt(8.0), 1.0))
        self._count += len(left)
        self._lacking += len(cells) - len(left)
        self._squares += float((left**2).sum())
        self._most = max(self._most, float(left.max(initial=0.0)))
        if len(q):
            before = np.where(np.isnan(self._last), q[0], self._last)
            q = np.unwrap(np.vstack([before, q]), axis=0)[1:]
            self._last = q[-1]
        angles = np.full((len(cells), len(self._axes)), np.nan)
        angles[good] = q
        return angles

    def conclude(self, where: str) -> Counter[str]:
        """Return what is to be told, by how often; raise RecordingError where the link turns otherwise."""
        joints = ", ".join(self.orientation.joints)
        if not self._count:
            remedy = "a quaternion has one length in all rows, a matrix orthogonal rows of length 1: check the columns"
            raise RecordingError(f"no row holds a rotation about {joints}", where=where, remedy=remedy)
        rms = np.sqrt(self._squares / self._count)
        told = f"{np.degrees(rms):.2g} deg rms, {np.degrees(self._most):.2g} deg at most"
        if rms > _OFF:
            raise RecordingError(
                f"the orientation turns otherwise than about the axes of {joints}, by {told}",
                where=where,
                remedy="check which column is the scalar, `maps`, the axes in the rig, and at_zero (what the file has "
                "where all joints are at zero)",
            )
        found = Counter({f"orientations turn otherwise than about the axes of {joints} by {told}": self._count})
        found[f"orientations of {joints} are no rotation, NaN"] = self._lacking
        return found

    def _solved(self, R: Array, where: str) -> Array:
        """Return angles (n, k) in -pi to pi: R = Rot(b1, q1) Rot(b2, q2) ..., as nearly as may be.

        The angles of the outer two follow from what they leave in place: Rot(b1, q1) takes Rot(b2, q2) b3 into R b3.
        With three joints, b1 . R b3 = b1 . Rot(b2, q2) b3 has two solutions q2; the one nearer zero is taken.
        """
        first, last = self._axes[0], self._axes[-1]
        if len(self._axes) == 1:
            spin = np.stack([R[:, i, j] - R[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))], axis=1) @ first
            return np.asarray(np.arctan2(spin, np.trace(R, axis1=1, axis2=2) - (R @ first) @ first))[:, None]
        out, back = np.broadcast_to(last, (len(R), 3)), np.broadcast_to(first, (len(R), 3))
        between = np.empty((len(R), 0))
        if len(self._axes) == 3:
            b = self._axes[1]
            along = (first @ b) * (b @ last)
            even, odd = first @ last - along, first @ np.cross(b, last)
            apart = np.arccos(np.clip(((R @ last) @ first - along) / np.hypot(even, odd), -1.0, 1.0))
            if len(R) and min(apart.min(), np.pi - apart.max()) < _NEAR:
                raise RecordingError(
                    f"two axes of {', '.join(self.orientation.joints)} become parallel: the orientation does not tell "
                    "their angles there",
                    where=where,
                    remedy="leave that part out (start_s, end_s), or give the angles in [encoder]",
                )
            middle = np.arctan2(odd, even)
            if not self._side and len(R):
                self._side = min((1.0, -1.0), key=lambda side: abs(_turned(middle + side * apart[0])))
            q = _turned(middle + self._side * apart)
            out, back, between = rotate(about_axis(b, q), out), rotate(about_axis(b, -q), back), q[:, None]
        start, end = _about(first, out, R @ last), _about(last, R.swapaxes(1, 2) @ first, back)
        return np.column_stack([start, between, end])


def _turned(angle: Array) -> Array:
    """Return angles in -pi to pi."""
    return np.asarray(np.angle(np.exp(1j * angle)))


def _about(axis: Array, v: Array, w: Array) -> Array:
    """Return the angle (n,) about a unit vector by which v (n, 3) comes nearest to w (n, 3)."""
    return np.asarray(np.arctan2(cross(v, w) @ axis, (v * w).sum(1) - (v @ axis) * (w @ axis)))


def _rotations(cells: Array, length: float | None) -> tuple[Array, Mask]:
    """Return rotation matrices (n, 3, 3) of quaternions (n, 4), w first, or matrices (n, 9), and which are such.

    Quaternions of one `length` may have any: their integers are often scaled. q and -q are one rotation.
    """
    if cells.shape[1] == 4:
        norm = np.linalg.norm(cells, axis=1)
        good = np.isfinite(norm) & (norm > 0.0)
        good &= np.abs(norm - (length or norm)) <= _UNEVEN * (length or norm)
        unit = cells / np.where(good, norm, 1.0)[:, None]
        S = skew(unit[:, 1:])
        return np.eye(3) + 2.0 * unit[:, :1, None] * S + 2.0 * (S @ S), good
    matrices = cells.reshape(-1, 3, 3)
    good = np.asarray(np.isfinite(cells).all(1))
    near, _, turned = np.linalg.svd(np.where(good[:, None, None], matrices, np.eye(3)))
    R = near @ turned
    good &= (np.abs(R - matrices).max((1, 2)) <= _UNEVEN) & (np.linalg.det(R) > 0.0)
    return R, good


def elements(cells: Array) -> Array:
    """Return the nine elements (n, 9) of the rotations that numbers (n, 4) or (n, 9) are, NaN where they are none."""
    R, good = _rotations(cells, None)
    return np.where(good[:, None], R.reshape(-1, 9), np.nan)


def written(columns: Sequence[str]) -> str:
    """Return the columns of an orientation, w, x, y, z or a matrix row by row, as a mapping has them."""
    if len(columns) == 4:
        pairs = ", ".join(f"{axis} = {column}" for axis, column in zip("wxyz", columns, strict=True))
        return f"quaternion = {{ {pairs} }}"
    rows = ", ".join(f"[{', '.join(columns[row : row + 3])}]" for row in (0, 3, 6))
    return f"matrix = [{rows}]"
