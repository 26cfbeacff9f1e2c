"""Resonances of the article on the elastic transducer, drives included, at a pose.

Small undamped motions about rest: M x'' + K x = 0 in the plate's three angles, the joints' angles and, for each drive,
its rotor's angle over the gear ratio. M is that of the rigid bodies and rotors; K holds the transducer's
stiffness and the slopes of the drives' own equations. Gravity's stiffness (weight times height, 1 % of the
transducer's on the paper's rig) and gyroscopic terms are left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from kbs_process.plant.effect import SIGNALS, Effect, Port
from kbs_process.plant.rigid import inertia_matrix, kinematics, links_beyond
from kbs_process.rig.model import LAB, TRANSDUCER, Drive, Rig
from kbs_process.signals.frames import from_rotation_vector, rotate
from kbs_process.signals.records import Array

AXES = "xyz"
# Only modes that turn the plate by this share of their strain energy are seen by the transducer.
SEEN = 0.02
_STEP = 1e-6  # rad


@dataclass(frozen=True, slots=True)
class Mode:
    """One mode in which the plate takes part."""

    axis: str  # of T, about which the plate turns most
    frequency: float  # Hz
    sigma: float  # Hz, from the uncertainty of the transducer's stiffness


@dataclass(frozen=True, slots=True, eq=False)
class _Freedom:
    """A rotation: about `axis` through `point`, both in the laboratory, of the links it carries."""

    axis: Array  # (3,)
    point: Array  # (3,) m
    carries: frozenset[str]


def modes(rig: Rig, effects: Sequence[Effect], q: Array) -> tuple[Mode, ...]:
    """Return the modes at joint angles q (joints,) that turn the plate, lowest first; none on a rigid transducer."""
    stiffness = rig.transducer.stiffness
    if stiffness is None or rig.transducer.on != LAB:
        return ()
    M, K = _matrices(rig, effects, q)
    squared, shapes = eigh(K, M)
    found = []
    for value, shape in zip(squared, shapes.T, strict=True):
        plate = (
            stiffness.value * shape[:3] ** 2 / value
        )  # shares of the strain energy: shapes are normed by M
        if plate.sum() > SEEN:
            frequency = float(np.sqrt(value) / (2 * np.pi))
            relative = 0.5 * float(np.linalg.norm(plate * stiffness.sigma / stiffness.value))
            found.append(Mode(AXES[int(np.argmax(plate))], frequency, frequency * relative))
    return tuple(found)


def _matrices(rig: Rig, effects: Sequence[Effect], q: Array) -> tuple[Array, Array]:
    """M and K of plate (3), joints (n) and rotors (n), the latter as angles at the output."""
    rest = np.zeros((1, len(q)))
    links = kinematics(rig, q[None, :], rest, rest)
    T = links[TRANSDUCER]
    beyond = links_beyond(rig)
    freedoms = [_Freedom(axis, T.r[0], beyond) for axis in T.R[0].T]
    for joint in rig.joints:
        parent = links[joint.parent]
        axis = rotate(parent.R, from_rotation_vector(joint.misalignment.value) @ np.asarray(joint.axis))[0]
        freedoms.append(_Freedom(axis, links[joint.name].r[0], _outwards(rig, joint.name)))
    n, size = len(rig.joints), 3 + 2 * len(rig.joints)
    M, K = np.zeros((size, size)), np.zeros((size, size))
    for body in rig.bodies:
        if body.on in beyond:
            link = links[body.on]
            centre = (link.r + rotate(link.R, body.cog.value))[0]
            spin = np.stack([f.axis * (body.on in f.carries) for f in freedoms], axis=1)
            arms = [np.cross(f.axis, centre - f.point) * (body.on in f.carries) for f in freedoms]
            velocity = np.stack(arms, axis=1)
            tensor = link.R[0] @ inertia_matrix(body.inertia.value) @ link.R[0].T
            M[: 3 + n, : 3 + n] += float(body.mass) * velocity.T @ velocity + spin.T @ tensor @ spin
    K[:3, :3] = np.diag(_stiffness(rig))
    for index, joint in enumerate(rig.joints):
        out, rotor = 3 + index, 3 + n + index
        if joint.drive is None:
            continue  # locked: its freedoms are struck out below
        axis = freedoms[out].axis
        turns = np.zeros(size)
        turns[: 3 + n] = [f.axis @ axis * (joint.parent in f.carries) for f in freedoms]
        turns[rotor] = float(joint.drive.ratio)
        M += float(joint.drive.rotor_inertia) * np.outer(turns, turns)
        gear, motor = _slopes(joint.drive, effects)
        K[out, out] += gear
        K[rotor, rotor] += gear + motor * float(joint.drive.ratio) ** 2
        K[out, rotor] -= gear
        K[rotor, out] -= gear
    free = [i for i in range(size) if i < 3 or rig.joints[(i - 3) % n].drive is not None]
    return M[np.ix_(free, free)], K[np.ix_(free, free)]


def _stiffness(rig: Rig) -> Array:
    assert rig.transducer.stiffness is not None
    return rig.transducer.stiffness.value


def _outwards(rig: Rig, name: str) -> frozenset[str]:
    """A joint's link and those that hang on it."""
    carried = {name}
    for joint in rig.joints:
        if joint.parent in carried:
            carried.add(joint.name)
    return frozenset(carried)


def _slopes(drive: Drive, effects: Sequence[Effect]) -> tuple[float, float]:
    """Stiffness of the gear at the output and of the motor at the rotor, N m/rad, at rest with the field at zero."""

    def torque(port: Port, signal: str, value: float) -> float:
        total = 0.0
        for effect in effects:
            if effect.port is port and not effect.states:
                known = dict.fromkeys(SIGNALS, 0.0) | {"ratio": float(drive.ratio), signal: value}
                known |= {name: float(quantity) for name, quantity in drive.parameters.items()}
                total += effect.equation(*(known[name] for name in effect.arguments))
        return total

    gear = torque(Port.TRANSMISSION, "joint_angle", -_STEP) - torque(Port.TRANSMISSION, "joint_angle", _STEP)
    motor = torque(Port.MOTOR_TORQUE, "rotor_angle", -_STEP) - torque(Port.MOTOR_TORQUE, "rotor_angle", _STEP)
    return gear / (2 * _STEP), motor / (2 * _STEP)
