"""The plant linearised about rest at a pose: M x'' + C x' + K x = B u, and what it does to the wrench.

The c coordinates x are the plate's angles about T's x, y and z (none on a rigid transducer), then the angles of
the n driven joints, then their rotors' angles over the gear ratio. The n inputs u are the motors' fields over the
gear ratio. So everything is in rad, of the plate or of the output.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from kbs_process.plant.effect import FIELD_SIGNALS, POINT_SIGNALS, SIGNALS, Effect, Port
from kbs_process.plant.linear.mounted import mounted_sag, mounted_slopes
from kbs_process.plant.rigid import LinkMotion, inertia_matrix, kinematics, links_beyond
from kbs_process.plant.structure import external_of
from kbs_process.rig.model import LAB, TRANSDUCER, Drive, Joint, Rig
from kbs_process.signals.frames import from_rotation_vector, rotate
from kbs_process.signals.records import Array

_STEP = 1e-6  # rad and rad/s, of central differences


@dataclass(frozen=True, slots=True, eq=False)
class Freedom:
    """A rotation: about `axis` through `point`, both in the laboratory, of the links it carries."""

    axis: Array  # (3,)
    point: Array  # (3,) m
    carries: frozenset[str]


@dataclass(frozen=True, slots=True, eq=False)
class Linear:
    """Matrices of the linearised plant; the first `plate` coordinates turn the transducer's plate."""

    plate: int  # 3, or 0 on a rigid transducer
    joints: tuple[str, ...]  # the driven ones
    M: Array  # (c, c) kg m^2
    C: Array  # (c, c) N m s/rad
    K: Array  # (c, c) N m/rad, gravity's included
    B: Array  # (c, n) N m/rad
    momentum: Array  # (6, c) linear, and angular momentum about T's origin, in T, for unit rates
    gravity: Array  # (6, c) change of the wrench of weight and other loads in the plate's own axes, for unit angles
    drag: Array  # (6, c) change of the other loads' wrench, for unit rates
    freedoms: tuple[Freedom, ...] = ()  # of plate and outputs, in the coordinates' order
    # Of each joint's field, and of its rate (s), what a motor has: all of the first and none of the second if not said.
    arriving: tuple[tuple[float, float], ...] = ()

    def output(self, joint: str) -> int:
        """Return the coordinate of a driven joint's angle."""
        return self.plate + self.joints.index(joint)


def linearise(rig: Rig, effects: Sequence[Effect], q: Array) -> Linear:
    r"""Linearise at joint angles q (joints,), rad, at rest.

    Equation: with a_i the axis of freedom i through p_i, c_b the CoG of a body b that it carries, and
        $v_{bi} = a_i \times (c_b - p_i)$:
        $M_{ij} = \sum_b m_b v_{bi} \cdot v_{bj} + a_i \cdot I_b a_j$, each rotor adds
        $J_r t_i t_j$, t being its absolute turns, and gravity adds $-m_b g \cdot (a_i \times v_{bj})$ to $K_{ij}$ for i
        inboard of j, the Hessian of its potential.
        A force $f(x, v)$ of the laboratory adds $-v_i \cdot f_x v_j - f \cdot (a_i \times v_j)$ to $K_{ij}$ and
        $-v_i \cdot f_v v_j$ to $C_{ij}$, $v_i$ being its point's; a torque of its the slopes, for all that carry it.
        A moment of the mounting adds its slopes at the plate's sag (`mounted`).
    Units: kg, m, rad, s.
    Validity: small motions about rest, at time 0. Slopes are those of the equations at rest, of a drive's without load:
        at a fifth of Tmax a motor's is 2 % less, in series with a gear that is 35 times as soft. Coulomb friction has
        no slope and is left out, effects' own states are held, the ground's torques count with their slopes alone, and
        the pose is the one without sag but for the mounting.
    Source: R. Featherstone, Rigid Body Dynamics Algorithms (2008), chapters 3 and 6.
    """
    pose = np.asarray(q, dtype=float)[None, :]
    links = kinematics(rig, pose, np.zeros_like(pose), np.zeros_like(pose))
    driven = tuple(joint for joint in rig.joints if joint.drive is not None)
    freedoms = _freedoms(rig, links, driven)
    n, turning = len(driven), len(freedoms)
    plate, size = turning - n, turning + n
    M, C, K = (np.zeros((size, size)) for _ in range(3))
    B, momentum, gravity = np.zeros((size, n)), np.zeros((6, size)), np.zeros((6, size))
    drag = np.zeros((6, size))
    _add_bodies(rig, links, freedoms, M, K, momentum, gravity)
    for effect in effects:
        if effect.port is Port.EXTERNAL_FORCE:
            _add_force(rig, effect, links, freedoms, (K, C), (gravity, drag))
    if plate:
        assert rig.transducer.stiffness is not None
        K[:3, :3] += np.diag(rig.transducer.stiffness.value)
        if rig.transducer.damping is not None:
            C[:3, :3] += np.diag(rig.transducer.damping.value)
        stiffness, damping = mounted_slopes(rig, effects, mounted_sag(rig, effects, q))
        K[:3, :3] += stiffness
        C[:3, :3] += damping
    R_TL = links[TRANSDUCER].R[0].T
    for index, joint in enumerate(driven):
        assert joint.drive is not None
        out, rotor = plate + index, turning + index
        axis = freedoms[out].axis
        turns = np.zeros(size)
        turns[:turning] = [f.axis @ axis * (joint.parent in f.carries) for f in freedoms]
        turns[rotor] = float(joint.drive.ratio)
        M += float(joint.drive.rotor_inertia) * np.outer(turns, turns)
        momentum[3:] += float(joint.drive.rotor_inertia) * np.outer(R_TL @ axis, turns)
        pair = np.ix_([out, rotor], [out, rotor])
        stiffness, damping, B[[out, rotor], index] = drive_slopes(joint.drive, effects)
        K[pair] += stiffness
        C[pair] += damping
        grounded = ground_slopes(joint.drive, effects, {"joint_angle": float(q[rig.joint_names.index(joint.name)])})
        for matrix, external, slope in zip((K, C), (gravity, drag), grounded, strict=True):
            inboard = [i for i in range(out) if joint.name in freedoms[i].carries]
            matrix[inboard, out] -= slope * np.array([freedoms[i].axis @ axis for i in inboard])
            matrix[out, out] -= slope
            external[3:, out] += slope * (R_TL @ axis)
    names = tuple(joint.name for joint in driven)
    arriving = tuple(field_slopes(joint.drive, effects) for joint in driven if joint.drive is not None)
    return Linear(plate, names, M, C, K, B, momentum, gravity, drag, tuple(freedoms), arriving)


def field_slopes(drive: Drive, effects: Sequence[Effect]) -> tuple[float, float]:
    """Return how the field that a motor has answers to the commanded one: to itself (1), and to its rate (s).

    Without what changes with time: a delay that beats has no part in a plant that does not.
    """
    effects = [effect for effect in effects if not (effect.port is Port.FIELD and "time" in effect.arguments)]
    known = dict.fromkeys(FIELD_SIGNALS, 0.0) | {"ratio": float(drive.ratio)}
    known |= {name: float(quantity) for name, quantity in drive.parameters.items()}
    of_field, of_rate = _port_slopes(effects, Port.FIELD, known, ("field_travel", "field_rate"))
    return 1.0 + of_field, of_rate


def drive_slopes(
    drive: Drive, effects: Sequence[Effect], at: Mapping[str, float] | None = None
) -> tuple[Array, Array, Array]:
    """Return stiffness (2, 2), damping (2, 2) and the field's action (2,) on output and rotor.

    Rotor and field count as angles at the output, their torques `ratio` times those at the motor: N m/rad, N m s/rad.
    The slopes are those at the signals `at`, without which all are zero: at rest, unloaded.
    """
    ratio = float(drive.ratio)
    torques = _torques(drive, effects)
    around = dict.fromkeys(SIGNALS, 0.0) | dict(at or {})
    field = ratio * _slope(torques, around, "field")
    return drive_stiffness(drive, effects, around), drive_damping(drive, effects, around), field


def drive_stiffness(drive: Drive, effects: Sequence[Effect], at: Mapping[str, float]) -> Array:
    """Return the stiffness (2, 2) of `drive_slopes` at all signals of the plant."""
    torques, ratio = _torques(drive, effects), float(drive.ratio)
    slopes = [_slope(torques, at, "joint_angle"), ratio * _slope(torques, at, "rotor_angle")]
    return -np.stack(slopes, axis=1)


def drive_damping(
    drive: Drive, effects: Sequence[Effect], at: Mapping[str, float], reach: Mapping[str, float] | None = None
) -> Array:
    """Return the damping (2, 2) of `drive_slopes` at all signals of the plant.

    Where a rate changes by a `reach` either way, rad/s, the slope is the mean over these rates, which is the secant.
    """
    torques, ratio, reach = _torques(drive, effects), float(drive.ratio), reach or {}
    output, rotor = (
        _slope(torques, at, name, max(_STEP, reach.get(name, 0.0))) for name in ("joint_rate", "rotor_rate")
    )
    return -np.stack([output, ratio * rotor], axis=1)


def _torques(drive: Drive, effects: Sequence[Effect]) -> Callable[[Mapping[str, float]], Array]:
    """Torques (2,) on output and rotor, as angles at the output count, for signals of the plant."""
    ratio = float(drive.ratio)
    constants = {name: float(quantity) for name, quantity in drive.parameters.items()} | {"ratio": ratio}
    acting = [e for e in effects if e.port.of_drive and e.port not in (Port.MOTOR_FRICTION, Port.FIELD)]

    def torques(signals: Mapping[str, float]) -> Array:
        known = dict(signals) | constants
        totals = dict.fromkeys(Port, 0.0)
        for effect in acting:
            totals[effect.port] += effect.value(known)[0]
        gear = totals[Port.TRANSMISSION]
        share = 1.0 + ratio * sum(effect.slope_at(known) for effect in acting)
        return np.array([gear + totals[Port.JOINT_TORQUE], ratio * totals[Port.MOTOR_TORQUE] - share * gear])

    return torques


def _slope(
    torques: Callable[[Mapping[str, float]], Array], at: Mapping[str, float], signal: str, reach: float = _STEP
) -> Array:
    ends = [torques({**at, signal: at[signal] + step}) for step in (reach, -reach)]
    return np.asarray((ends[0] - ends[1]) / (2.0 * reach), dtype=np.float64)


def ground_slopes(
    drive: Drive, effects: Sequence[Effect], at: Mapping[str, float] | None = None
) -> tuple[float, float]:
    """Return the slopes of the laboratory's torques on an output with its angle and rate: N m/rad, N m s/rad."""
    known = dict.fromkeys(SIGNALS, 0.0) | {"ratio": float(drive.ratio)}
    known |= {name: float(quantity) for name, quantity in drive.parameters.items()} | dict(at or {})
    return _port_slopes(effects, Port.GROUND_TORQUE, known, ("joint_angle", "joint_rate"))


def _port_slopes(
    effects: Sequence[Effect], port: Port, known: Mapping[str, float], signals: tuple[str, str]
) -> tuple[float, float]:
    """Slopes, with two signals, of the sum of all effects at a port."""
    found = []
    for signal in signals:
        ends = [{**known, signal: known[signal] + step} for step in (_STEP, -_STEP)]
        ahead, behind = (sum(e.value(end)[0] for e in effects if e.port is port) for end in ends)
        found.append((ahead - behind) / (2.0 * _STEP))
    return found[0], found[1]


def _freedoms(rig: Rig, links: dict[str, LinkMotion], driven: Sequence[Joint]) -> list[Freedom]:
    """The plate's axes where it is elastic, then the driven joints', from the laboratory outwards."""
    T = links[TRANSDUCER]
    freedoms = []
    if rig.transducer.stiffness is not None and rig.transducer.on == LAB:
        freedoms = [Freedom(axis, T.r[0], links_beyond(rig)) for axis in T.R[0].T]
    for joint in driven:
        turned = from_rotation_vector(joint.misalignment.value) @ np.asarray(joint.axis)
        axis = rotate(links[joint.parent].R, turned)[0]
        freedoms.append(Freedom(axis, links[joint.name].r[0], _outwards(rig, joint.name)))
    return freedoms


def _add_bodies(
    rig: Rig,
    links: dict[str, LinkMotion],
    freedoms: Sequence[Freedom],
    M: Array,
    K: Array,
    momentum: Array,
    gravity: Array,
) -> None:
    """Add what mass, inertia and weight of the bodies beyond T contribute, to the freedoms' rows and columns."""
    T, beyond = links[TRANSDUCER], links_beyond(rig)
    R_TL, down = T.R[0].T, np.array([0.0, 0.0, -float(rig.gravity)])
    count = len(freedoms)
    turning = slice(0, count)
    for body in rig.bodies:
        if body.on not in beyond:
            continue
        link, mass = links[body.on], float(body.mass)
        centre = (link.r + rotate(link.R, body.cog.value))[0]
        spin = np.stack([f.axis * (body.on in f.carries) for f in freedoms], axis=1)
        arm = np.stack([np.cross(f.axis, centre - f.point) * (body.on in f.carries) for f in freedoms], 1)
        tensor = link.R[0] @ inertia_matrix(body.inertia.value) @ link.R[0].T
        M[turning, turning] += mass * arm.T @ arm + spin.T @ tensor @ spin
        lever = centre - T.r[0]
        momentum[:3, turning] += R_TL @ (mass * arm)
        momentum[3:, turning] += R_TL @ (mass * np.cross(lever, arm, axisb=0).T + tensor @ spin)
        for j in range(count):
            for i in range(j + 1):
                second = -mass * down @ np.cross(spin[:, i], arm[:, j])
                K[i, j] += second
                K[j, i] += second * (i != j)
            # Seen from the plate, its own turn tilts gravity, and a joint's turn moves the CoG.
            on_plate = TRANSDUCER in freedoms[j].carries
            tilted = -np.cross(freedoms[j].axis, down) if on_plate else np.zeros(3)
            moved = np.zeros(3) if on_plate else arm[:, j]
            gravity[:3, j] += R_TL @ (mass * tilted)
            gravity[3:, j] += R_TL @ (mass * (np.cross(lever, tilted) + np.cross(moved, down)))


def _add_force(
    rig: Rig,
    effect: Effect,
    links: dict[str, LinkMotion],
    freedoms: Sequence[Freedom],
    matrices: tuple[Array, Array],
    wrench: tuple[Array, Array],
) -> None:
    """Add what a force of the laboratory on a point contributes to stiffness, damping and the wrench, all in T."""
    external = external_of(rig, effect)
    assert external.point is not None
    T, link = links[TRANSDUCER], links[external.on]
    R_TL = T.R[0].T
    point = (link.r + rotate(link.R, external.point.value))[0]
    lever = R_TL @ (point - T.r[0])
    parameters = {name: float(quantity) for name, quantity in external.parameters.items()}
    rest = dict.fromkeys(POINT_SIGNALS, 0.0) | dict(zip("xyz", lever, strict=True)) | parameters
    force = np.array(effect.value(rest))

    def slope(signals: Sequence[str]) -> Array:
        ahead, behind = (
            np.array([effect.value(rest | {name: rest[name] + step}) for name in signals]) for step in (_STEP, -_STEP)
        )
        slopes: Array = (ahead - behind).T / (2.0 * _STEP)
        return slopes

    spin = np.stack([R_TL @ f.axis * (external.on in f.carries) for f in freedoms], axis=1)
    arm = np.stack([R_TL @ np.cross(f.axis, point - f.point) * (external.on in f.carries) for f in freedoms], 1)
    on_plate = np.array([TRANSDUCER in f.carries for f in freedoms])
    count = len(freedoms)
    for matrix, out, change in zip(matrices, wrench, (slope("xyz"), slope(("vx", "vy", "vz"))), strict=True):
        matrix[:count, :count] -= arm.T @ change @ arm
        out[:3, :count] += change @ arm
        out[3:, :count] += np.cross(lever, change @ arm, axisb=0).T
    # The force turns in the plate's axes as the plate does, and a joint moves its point there.
    tilted = np.cross(force, spin, axisb=0).T * on_plate
    wrench[0][:3, :count] += tilted
    wrench[0][3:, :count] += np.cross(lever, tilted, axisb=0).T + np.cross(arm * ~on_plate, force, axisa=0).T
    for j in range(count):
        for i in range(j + 1):
            second = -force @ np.cross(spin[:, i], arm[:, j])
            matrices[0][i, j] += second
            matrices[0][j, i] += second * (i != j)


def _outwards(rig: Rig, name: str) -> frozenset[str]:
    """A joint's link and those that hang on it."""
    carried = {name}
    for joint in rig.joints:
        if joint.parent in carried:
            carried.add(joint.name)
    return frozenset(carried)
