"""Where an unknown input can enter the plant: one scalar each, and what it does to the linearised plant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from kbs_process.plant.linear.linearise import Freedom, Linear
from kbs_process.plant.rigid import LinkMotion, kinematics, links_beyond
from kbs_process.rig.model import LAB, TRANSDUCER, Rig
from kbs_process.signals.frames import rotate
from kbs_process.signals.records import WRENCH_CHANNELS, Array

DRIVE_PORTS = ("motor_torque", "motor_friction", "transmission", "joint_torque")
GROUND_PORT, WRENCH_PORT, BASE_PORT = "ground_torque", "external_wrench", "base_acceleration"
MOUNTING_PORT = "base_torque"
_BASE_AXES = ("x", "y", "z")


@dataclass(frozen=True, slots=True)
class Inlet:
    """One scalar input of the plant.

    A drive's: `where` is its joint, N m with the sign of `plant.effect.Port` (friction: as a torque on the rotor).
    "ground_torque": on the output of joint `where` about its axis, N m, reacted by the laboratory.
    "external_wrench": from the laboratory on link `where`, `axis` one of Fx .. Tz, N or N m, about T's origin in the
    undeflected T's axes. "base_acceleration": of the floor along T's axes, x .. z, m/s^2. "base_torque": moment of the
    mounting on an elastic transducer's plate about T's axes, x .. z, N m.
    """

    port: str
    where: str
    axis: str = ""


def inlets_of(rig: Rig) -> tuple[Inlet, ...]:
    """Every inlet of a rig: drives, wrenches on each link beyond T, the floor, the mounting of a plate that turns."""
    drives = [Inlet(port, joint.name) for joint in rig.joints if joint.drive is not None for port in DRIVE_PORTS]
    grounds = [Inlet(GROUND_PORT, joint.name) for joint in rig.joints if joint.drive is not None]
    links = [name for name in (TRANSDUCER, *rig.joint_names) if name in links_beyond(rig)]
    wrenches = [Inlet(WRENCH_PORT, link, axis) for link in links for axis in WRENCH_CHANNELS]
    beneath = (BASE_PORT, MOUNTING_PORT) if plate_turns(rig) else (BASE_PORT,)
    return (*drives, *grounds, *wrenches, *(Inlet(port, "", axis) for port in beneath for axis in _BASE_AXES))


def plate_turns(rig: Rig) -> bool:
    """Whether the transducer's plate turns on springs in the laboratory."""
    return rig.transducer.stiffness is not None and rig.transducer.on == LAB


def generalised(rig: Rig, system: Linear, inlets: Sequence[Inlet], q: Array) -> tuple[Array, Array]:
    r"""Generalised forces (c, m) of unit inputs on the linear plant at q, and their direct share (6, m) of the wrench.

    Equation: virtual work. A wrench (F, M) about T's origin on a link works
        $M \cdot a_i + F \cdot a_i \times (o - p_i)$ in a unit turn about axis $a_i$ through $p_i$ that carries the
        link; an acceleration of the floor acts like one of all masses the other way: minus the momentum's rows. A
        moment of the mounting turns the plate, and is none of what the unit exerts on it.
    Units: rad of the output for rotors, hence `ratio` times the motor's torque.
    """
    pose = np.asarray(q, dtype=float)[None, :]
    links = kinematics(rig, pose, np.zeros_like(pose), np.zeros_like(pose))
    T = links[TRANSDUCER]
    R_TL = T.R[0].T
    reaching = [_reach(freedom, R_TL, T.r[0]) for freedom in system.freedoms]
    size, turning = len(system.M), len(system.freedoms)
    force, direct = np.zeros((size, len(inlets))), np.zeros((6, len(inlets)))
    rigid = _rigid_inertia(rig, links) if any(inlet.port == BASE_PORT for inlet in inlets) else np.zeros((6, 6))
    for column, inlet in enumerate(inlets):
        if inlet.port in DRIVE_PORTS:
            out = system.output(inlet.where)
            rotor = turning + system.joints.index(inlet.where)
            drive = rig.joint(inlet.where).drive
            assert drive is not None
            if inlet.port in ("motor_torque", "motor_friction"):
                force[rotor, column] = float(drive.ratio)
            else:
                force[out, column] = 1.0
                force[rotor, column] = -1.0 * (inlet.port == "transmission")
        elif inlet.port in (GROUND_PORT, WRENCH_PORT):
            wrench = np.eye(6)[WRENCH_CHANNELS.index(inlet.axis)] if inlet.axis else np.zeros(6)
            if inlet.port == GROUND_PORT:
                wrench[3:] = reaching[system.output(inlet.where)][3:]
            direct[:, column] = wrench
            for row, (freedom, reach) in enumerate(zip(system.freedoms, reaching, strict=True)):
                if inlet.where in freedom.carries:
                    force[row, column] = wrench @ reach
        elif inlet.port == MOUNTING_PORT:
            force[_BASE_AXES.index(inlet.axis), column] = 1.0
        else:
            axis = _BASE_AXES.index(inlet.axis)
            direct[:, column] = -rigid[:, axis]
            # The momentum of unit rates about T's origin is, transposed, what moves with the floor feels.
            force[:, column] = -system.momentum[axis]
    return force, direct


def _reach(freedom: Freedom, R_TL: Array, origin: Array) -> Array:
    """What a unit turn does to a link it carries, in T: velocity of the point at T's origin, then rate, (6,)."""
    return np.concatenate([R_TL @ np.cross(freedom.axis, origin - freedom.point), R_TL @ freedom.axis])


def _rigid_inertia(rig: Rig, links: Mapping[str, LinkMotion]) -> Array:
    """Inertia (6, 6) of all beyond T as one body about T's origin, in T: force and moment for unit accelerations."""
    T, total = links[TRANSDUCER], np.zeros((6, 6))
    R_TL = T.R[0].T
    for body in rig.bodies:
        if body.on not in links_beyond(rig):
            continue
        link, mass = links[body.on], float(body.mass)
        r = R_TL @ ((link.r + rotate(link.R, body.cog.value))[0] - T.r[0])
        across = np.cross(np.eye(3), r)  # row i: e_i x r
        R = R_TL @ link.R[0]
        xx, yy, zz, xy, xz, yz = body.inertia.value
        tensor = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T
        total[:3, :3] += mass * np.eye(3)
        total[:3, 3:] += mass * across.T
        total[3:, :3] += mass * across
        total[3:, 3:] += tensor + mass * (r @ r * np.eye(3) - np.outer(r, r))
    return total
