"""Effects along a measured motion: what they add to the loads of a rig that its motion drives.

The motion is what it is, whatever acts: an effect shows only in what the drives have to put in against it. What acts
between a joint's two links leaves no trace in the wrench beneath them; a force of the laboratory does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from kbs_process.plant.along import along, signals_of
from kbs_process.plant.effect import Effect, Port
from kbs_process.plant.external import external_efforts, external_wrench
from kbs_process.rig.model import Joint, Rig
from kbs_process.signals.averages import instants
from kbs_process.signals.records import Array

# Ports whose torque acts on the joint as on its rotor, where nothing gives between them.
RIGID = {
    Port.JOINT_TORQUE: False,
    Port.MOTOR_TORQUE: True,
    Port.MOTOR_FRICTION: True,
}  # times the gear's ratio?


def added_loads(rig: Rig, effects: Sequence[Effect], q: Array, qd: Array, dt: float) -> Array:
    r"""What effects add to `rigid.loads` along a motion q, qd (n, joints): (n, 6 + joints) in its order and units.

    Equation: $\Delta \tau_j = -T_j$ of an effect on the output, $-R_j T_j$ of one on the rotor, over the effort's gain;
        of a force on a link, `external_wrench` and `external_efforts`.
    Validity: stiff transmission, angles good to the rates that an effect asks for. Effects of other ports, and of
        drives that have not their parameters, add nothing.
    """
    added = np.zeros((len(q), 6 + len(rig.joints)))
    efforts = np.zeros((len(q), len(rig.joints)))
    if any(effect.port is Port.EXTERNAL_FORCE for effect in effects):
        added[:, :6] = external_wrench(rig, effects, q, qd)
        efforts = external_efforts(rig, effects, q, qd)
    for index, joint in enumerate(rig.joints):
        if joint.effort is None:
            continue
        added[:, 6 + index] = efforts[:, index] / float(joint.effort.gain)
        if joint.drive is None:
            continue
        known = {name: float(quantity) for name, quantity in joint.drive.parameters.items()}
        for effect in effects:
            if effect.port in RIGID and all(entry.name in known for entry in effect.parameters):
                units = unit_torques(effect, joint, q[:, index], known, dt)
                amplitudes = [known[entry.name] for entry in effect.parameters if entry.role == "amplitude"]
                torque = instants(units @ np.array(amplitudes))
                added[:, 6 + index] += reading(joint, effect.port) * torque
    return added


def reading(joint: Joint, port: Port) -> float:
    """What a unit of torque (N m, N) at a port of a joint's drive adds to the joint's effort as read."""
    if joint.effort is None or port not in RIGID:
        return 0.0
    ratio = float(joint.drive.ratio) if RIGID[port] and joint.drive is not None else 1.0
    return -ratio / float(joint.effort.gain)


def unit_torques(effect: Effect, joint: Joint, q: Array, values: Mapping[str, float], dt: float) -> Array:
    """Means over the samples' intervals of an effect's torque, (n, amplitudes), for 1 of each amplitude.

    `values` are the parameters that are no amplitudes. The rotor turns with the joint's coordinate q (n,).
    """
    ratio = 1.0 if joint.drive is None else float(joint.drive.ratio)
    turned = {"joint_angle": q, "rotor_angle": ratio * q, "time": dt * np.arange(len(q), dtype=np.float64)}
    signals = {name: turned[name] for name in signals_of(effect)}
    return along(effect, signals, {**values, "ratio": ratio}, dt)[:, :, 0]
