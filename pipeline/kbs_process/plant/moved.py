"""Effects along a measured motion: what they add to the loads of a rig that its motion drives.

The motion is what it is, whatever acts: an effect shows only in what the drives have to put in against it. What acts
between a joint's two links leaves no trace in the wrench beneath them; forces and torques of the laboratory do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from kbs_process.plant.along import along, signals_of
from kbs_process.plant.effect import Effect, Port
from kbs_process.plant.external import external_efforts, external_wrench
from kbs_process.plant.rigid import links_beyond, poses
from kbs_process.plant.structure import other_joint
from kbs_process.rig.model import TRANSDUCER, Joint, Rig
from kbs_process.signals.averages import instants
from kbs_process.signals.frames import cross, rotate
from kbs_process.signals.records import Array

# Ports whose torque acts on the joint as on its rotor, where nothing gives between them.
RIGID = {Port.JOINT_TORQUE: False, Port.MOTOR_TORQUE: True, Port.MOTOR_FRICTION: True}  # times the gear's ratio?


def added_loads(rig: Rig, effects: Sequence[Effect], q: Array, qd: Array, dt: float) -> Array:
    r"""What effects add to `rigid.loads` along a motion q, qd (n, joints): (n, 6 + joints) in its order and units.

    Equation: $\Delta \tau_j = -T_j$ of an effect on the output, $-R_j T_j$ of one on the rotor, over the effort's gain;
        of one against the ground, `grounded`; of a force on a link, `external_wrench` and `external_efforts`.
    Validity: stiff transmission, angles good to the rates that an effect asks for. Effects of other ports, and of
        drives that have not their parameters, add nothing.
    """
    added = np.zeros((len(q), 6 + len(rig.joints)))
    efforts = np.zeros((len(q), len(rig.joints)))
    if any(effect.port is Port.EXTERNAL_FORCE for effect in effects):
        added[:, :6] = external_wrench(rig, effects, q, qd)
        efforts = external_efforts(rig, effects, q, qd)
    grounds = grounded(rig, q) if any(effect.port is Port.GROUND_TORQUE for effect in effects) else {}
    for index, joint in enumerate(rig.joints):
        if joint.effort is not None:
            added[:, 6 + index] += efforts[:, index] / float(joint.effort.gain)
        if joint.drive is None:
            continue
        known = {name: float(quantity) for name, quantity in joint.drive.parameters.items()}
        for effect in effects:
            if "field" in effect.arguments or not all(entry.name in known for entry in effect.parameters):
                continue  # no field turns what a measured motion turns
            if effect.port is Port.GROUND_TORQUE or (effect.port in RIGID and joint.effort is not None):
                other = q[:, rig.joint_names.index(other_joint(rig, joint.name))]
                units = unit_torques(effect, joint, q[:, index], known, dt, other)
                amplitudes = [known[entry.name] for entry in effect.amplitudes]
                torque = instants(units @ np.array(amplitudes))
                if effect.port is Port.GROUND_TORQUE:
                    added += grounds[joint.name] * torque[:, None]
                else:
                    added[:, 6 + index] += reading(joint, effect.port) * torque
    return added


def grounded(rig: Rig, q: Array) -> dict[str, Array]:
    r"""What `rigid.loads` (n, 6 + joints) answer to a unit that the ground puts into a joint's output, by joint.

    Equation: `pressed` by the wrench $(0, e_j)$, or $(e_j, (p_j - o) \times e_j)$ of a joint that slides along $e_j$.
    """
    links = poses(rig, q)
    T, answers = links[TRANSDUCER], pressed(rig, q)
    R_TL = np.swapaxes(T.R, 1, 2)
    found = {}
    for joint in rig.joints:
        turn, slide = joint.screw
        axis = links[joint.name].axis
        moment = turn * axis + slide * cross(links[joint.name].r - T.r, axis)
        wrench = np.hstack([slide * rotate(R_TL, axis), rotate(R_TL, moment)])
        found[joint.name] = rotate(answers[joint.name], wrench)
    return found


def pressed(rig: Rig, q: Array) -> dict[str, Array]:
    r"""What `rigid.loads` answer to units of a wrench of the laboratory on a link, by link, (n, 6 + joints, 6).

    Equation: a wrench (F, M) about T's origin o, in T's axes, on a link is read as it is by a transducer beneath that
        link; joints j that carry the link put in $-(M \cdot e_j + F \cdot e_j \times (o - p_j))$, or $-F \cdot e_j$
        if they slide.
    Units: rad, N, N m -> N, N m, units of the efforts.
    Validity: a plate that does not give way.
    """
    links = poses(rig, q)
    T = links[TRANSDUCER]
    R_TL = np.swapaxes(T.R, 1, 2)
    found = {}
    for name in rig.joint_names:
        answer = np.zeros((len(q), 6 + len(rig.joints), 6))
        if name in links_beyond(rig):
            answer[:, :6] = np.eye(6)
        for row, joint in enumerate(rig.joints, 6):
            if joint.effort is not None and name in links_beyond(rig, joint.name):
                turn, slide = joint.screw
                axis = links[joint.name].axis
                force = turn * cross(axis, T.r - links[joint.name].r) + slide * axis
                works = np.hstack([rotate(R_TL, force), turn * rotate(R_TL, axis)])
                answer[:, row] = -works / float(joint.effort.gain)
        found[name] = answer
    return found


def reading(joint: Joint, port: Port) -> float:
    """What a unit of torque (N m, N) at a port of a joint's drive adds to the joint's effort as read."""
    if joint.effort is None or port not in RIGID:
        return 0.0
    ratio = float(joint.drive.ratio) if RIGID[port] and joint.drive is not None else 1.0
    return -ratio / float(joint.effort.gain)


def unit_torques(
    effect: Effect, joint: Joint, q: Array, values: Mapping[str, float], dt: float, other: Array | None = None
) -> Array:
    """Means over the samples' intervals of an effect's torque, (n, amplitudes), for 1 of each amplitude.

    `values` are the parameters that are no amplitudes. The rotor turns with the joint's coordinate q (n,); `other` is
    that of the other joint, where there is one.
    """
    ratio = 1.0 if joint.drive is None else float(joint.drive.ratio)
    turned = {"joint_angle": q, "rotor_angle": ratio * q, "time": dt * np.arange(len(q), dtype=np.float64)}
    if other is not None:
        turned["other_angle"] = other
    signals = {name: turned[name] for name in signals_of(effect)}
    return along(effect, signals, {**values, "ratio": ratio}, dt)[:, :, 0]
