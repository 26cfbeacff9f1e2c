"""What a motion needs, by inverse dynamics of the rig with floor and base as further joints.

Freedoms: what the floor's acceleration along x, y, z is made of, a = dz/dt + `STILL` z (z in m/s, white where a floor
is usual), which shows by itself and not by where it takes the floor; the plate's angles about x, then y, then z; the
rig's joints. Compiled, as slopes ask for it hundreds of times.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kbs_process.machine_code import njit
from kbs_process.plant.rigid import inertia_matrix
from kbs_process.rig.model import LAB, TRANSDUCER, Rig
from kbs_process.signals.frames import from_rotation_vector, from_tilt
from kbs_process.signals.records import Array

FLOOR, PLATE = slice(0, 3), slice(3, 6)
STILL = 2.0 * np.pi  # rad/s: above it a floor shakes with velocities of one density, below with accelerations
FIRST_JOINT = 6
Motion = tuple[Array, Array, Array]  # values, rates, accelerations (n, freedoms)
Loads = tuple[Array, Array]


class Chain(NamedTuple):
    """A rig as numbers: the plate's three turns are joints 0 to 2, about axes that the transducer is inclined by."""

    upward: Array  # (3,) m/s^2
    parent: NDArray[np.int64]  # (j,) -1: the floor
    fixed: Array  # (j, 3, 3) turn before a joint's own
    axis: Array  # (j, 3) of the joint, after that
    origin: Array  # (j, 3) m
    slides: NDArray[np.bool_]  # (j,)
    spin: Array  # (j,) kg m^2 of a rotor on the joint's carrier
    on: NDArray[np.int64]  # (b,) joint that a body is on
    mass: Array  # (b,) kg
    cog: Array  # (b, 3) m
    inertia: Array  # (b, 3, 3) kg m^2


@lru_cache(maxsize=8)  # slopes by the motion ask for one rig many times
def chain(rig: Rig) -> Chain:
    """The rig on three turns of its plate; bodies that rest on the floor show nowhere."""
    order = {joint.name: 3 + k for k, joint in enumerate(rig.joints)} | {TRANSDUCER: 2, LAB: -1}
    rotors = [float(joint.drive.rotor_inertia) if joint.drive else 0.0 for joint in rig.joints]
    level, tilt = np.eye(3), from_tilt(rig.transducer.tilt.value)
    bodies = [body for body in rig.bodies if order[body.on] >= 0]
    return Chain(
        np.array([0.0, 0.0, float(rig.gravity)]),
        np.array([-1, 0, 1, *(order[joint.parent] for joint in rig.joints)]),
        np.array([tilt, level, level, *(from_rotation_vector(joint.misalignment.value) for joint in rig.joints)]),
        np.array([*level, *(joint.axis for joint in rig.joints)], dtype=float),
        np.array([*np.zeros((3, 3)), *(joint.origin.value for joint in rig.joints)]),
        np.array([False] * 3 + [joint.type == "prismatic" for joint in rig.joints]),
        np.array([0.0, 0.0, 0.0, *rotors]),
        np.array([order[body.on] for body in bodies]),
        np.array([float(body.mass) for body in bodies]),
        np.array([body.cog.value for body in bodies]),
        np.array([inertia_matrix(body.inertia.value) for body in bodies]),
    )


def needed(rig: Rig, motion: Motion, rotors: tuple[Array, Array]) -> Loads:
    """Wrench (n, 6) on the transducer in the plate's axes, and efforts (n, 3 + joints) of plate and joints.

    Of a joint with a motor it is the torque on the output: what the rotor itself takes is the drive's. `rotors` are
    the rates and accelerations (n, joints) of motors on their carriers: they follow the field, not what rings behind
    the gear.
    """
    angle, rate, acceleration = motion
    shaken = angle.copy()
    shaken[:, FLOOR] = rate[:, FLOOR] + STILL * angle[:, FLOOR]
    return _needed(*chain(rig), shaken, rate, acceleration, *rotors)


@njit(cache=True, inline="always")
def _add_cross(out: Array, a: Array, b: Array, k: float) -> None:
    """Add k a x b."""
    out[0] += k * (a[1] * b[2] - a[2] * b[1])
    out[1] += k * (a[2] * b[0] - a[0] * b[2])
    out[2] += k * (a[0] * b[1] - a[1] * b[0])


@njit(cache=True, inline="always")
def _turn(out: Array, R: Array, a: Array) -> None:
    """R a."""
    for i in range(3):
        out[i] = R[i, 0] * a[0] + R[i, 1] * a[1] + R[i, 2] * a[2]


@njit(cache=True, inline="always")
def _turn_back(out: Array, R: Array, a: Array) -> None:
    """R^T a."""
    for i in range(3):
        out[i] = R[0, i] * a[0] + R[1, i] * a[1] + R[2, i] * a[2]


@njit(cache=True, inline="always")
def _dot(a: Array, b: Array) -> float:
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@njit(cache=True, nogil=True)
def _needed(
    upward: Array,
    parent: NDArray[np.int64],
    fixed: Array,
    axis: Array,
    origin: Array,
    slides: NDArray[np.bool_],
    spin: Array,
    on: NDArray[np.int64],
    mass: Array,
    cog: Array,
    inertia: Array,
    x: Array,
    rate: Array,
    acceleration: Array,
    turn: Array,
    hasten: Array,
) -> Loads:
    """Newton and Euler: outwards for motions in the laboratory's axes, inwards for what they need."""
    n, joints = len(x), len(parent)
    wrench, efforts = np.zeros((n, 6)), np.zeros((n, joints))
    # One more link than joints: the last is the floor.
    R, r = np.zeros((joints + 1, 3, 3)), np.zeros((joints + 1, 3))
    e, w, a, g = np.zeros((joints, 3)), np.zeros((joints + 1, 3)), np.zeros((joints + 1, 3)), np.zeros((joints + 1, 3))
    force, moment = np.zeros((joints + 1, 3)), np.zeros((joints + 1, 3))
    for u in range(3):
        R[joints, u, u] = 1.0
    turned, arm, c, F, one, other, spun = (
        np.zeros((3, 3)), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3),
    )  # fmt: skip
    for i in range(n):
        for j in range(joints + 1):
            for u in range(3):
                force[j, u] = moment[j, u] = 0.0
        for u in range(3):
            g[joints, u] = upward[u] + x[i, u]
        for j in range(joints):
            p, q, qd, qdd = parent[j], x[i, 3 + j], rate[i, 3 + j], acceleration[i, 3 + j]
            for u in range(3):
                _turn_back(turned[u], fixed[j], R[p, u])
            _turn(e[j], turned, axis[j])
            _turn(arm, R[p], origin[j])
            if slides[j]:
                for u in range(3):
                    arm[u] += e[j, u] * q
                    for v in range(3):
                        R[j, u, v] = turned[u, v]
            else:
                sine, rest = np.sin(q), 2.0 * np.sin(q / 2) ** 2
                for u in range(3):  # rows times Rodrigues' turn: v + sin q v x axis + (1 - cos q) (v x axis) x axis
                    for v in range(3):
                        one[v] = other[v] = 0.0
                    _add_cross(one, turned[u], axis[j], 1.0)
                    _add_cross(other, one, axis[j], 1.0)
                    for v in range(3):
                        R[j, u, v] = turned[u, v] + sine * one[v] + rest * other[v]
            for u in range(3):
                one[u] = 0.0
            _add_cross(one, w[p], arm, 1.0)
            for u in range(3):
                r[j, u] = r[p, u] + arm[u]
                w[j, u], a[j, u], g[j, u] = w[p, u], a[p, u], g[p, u]
            _add_cross(g[j], a[p], arm, 1.0)
            _add_cross(g[j], w[p], one, 1.0)
            if slides[j]:
                _add_cross(g[j], w[p], e[j], 2.0 * qd)
                for u in range(3):
                    g[j, u] += e[j, u] * qdd
            else:
                _add_cross(a[j], w[p], e[j], qd)
                for u in range(3):
                    w[j, u] += e[j, u] * qd
                    a[j, u] += e[j, u] * qdd
            if spin[j] > 0.0:
                hasty = _dot(a[p], e[j]) + hasten[i, j - 3]
                _add_cross(moment[p], w[p], e[j], -spin[j] * (_dot(w[p], e[j]) + turn[i, j - 3]))
                for u in range(3):
                    moment[p, u] -= spin[j] * hasty * e[j, u]
        for b in range(len(on)):
            j = on[b]
            _turn(c, R[j], cog[b])
            for u in range(3):
                one[u], F[u] = 0.0, g[j, u]
            _add_cross(one, w[j], c, 1.0)
            _add_cross(F, a[j], c, 1.0)
            _add_cross(F, w[j], one, 1.0)
            for u in range(3):
                F[u] *= -mass[b]
                force[j, u] += F[u]
            _add_cross(moment[j], c, F, 1.0)
            _turn_back(one, R[j], w[j])
            _turn(spun, inertia[b], one)
            _turn_back(c, R[j], a[j])
            _turn(other, inertia[b], c)
            _add_cross(other, one, spun, 1.0)
            _turn(spun, R[j], other)
            for u in range(3):
                moment[j, u] -= spun[u]
        for j in range(joints - 1, -1, -1):
            efforts[i, j] = -_dot(e[j], force[j]) if slides[j] else -_dot(e[j], moment[j])
            p = parent[j]
            for u in range(3):
                arm[u] = r[j, u] - r[p, u]
                force[p, u] += force[j, u]
                moment[p, u] += moment[j, u]
            _add_cross(moment[p], arm, force[j], 1.0)
            if j == 2:
                _turn_back(wrench[i, :3], R[2], force[2])
                _turn_back(wrench[i, 3:], R[2], moment[2])
    return wrench, efforts
