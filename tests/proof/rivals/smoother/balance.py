"""What a motion needs, by inverse dynamics of the rig with floor and base as further joints.

Freedoms: the floor's acceleration along x, y, z (m/s^2), which shows by itself and not by where it takes the floor;
the plate's angles about x, then y, then z; the rig's joints.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from kbs_process.plant.rigid import inverse_dynamics, joint_efforts, kinematics
from kbs_process.rig.model import LAB, Joint, Quantity, Rig
from proof.rivals.case import Array

FLOOR, PLATE = slice(0, 3), slice(3, 6)
FIRST_JOINT = 6
Motion = tuple[Array, Array, Array]  # values, rates, accelerations (n, freedoms)
Loads = tuple[Array, Array]


def needed(rig: Rig, motion: Motion) -> Loads:
    """Wrench (n, 6) on the transducer in the plate's axes, and efforts (n, 3 + joints) of plate and joints.

    Of a joint with a motor it is the torque on the output: what the rotor itself takes is the drive's.
    """
    x, rate, acceleration = (part.copy() for part in motion)
    acceleration[:, FLOOR], x[:, FLOOR], rate[:, FLOOR] = x[:, FLOOR], 0.0, 0.0
    whole = _with_base(rig)
    wrench = inverse_dynamics(whole, x, rate, acceleration, sag=False)
    efforts = joint_efforts(whole, x, rate, acceleration)[:, 3:]
    links = kinematics(whole, x, rate, acceleration)
    for k, joint in enumerate(rig.joints):
        if joint.drive is not None:
            ratio = float(joint.drive.ratio)
            turned = np.sum(links[joint.name].axis * links[joint.parent].alpha, axis=1)
            spin = ratio * acceleration[:, FIRST_JOINT + k] + turned
            efforts[:, 3 + k] -= ratio * float(joint.drive.rotor_inertia) * spin
    return wrench, efforts


def _with_base(rig: Rig) -> Rig:
    """The rig on three slides and three turns, which carry the transducer."""
    tilt = Rotation.from_euler("xyz", [*rig.transducer.tilt.value, 0.0]).as_rotvec()
    added, parent = [], LAB
    for kind in ("prismatic", "revolute"):
        for axis in np.eye(3):
            inclined = _exact(tilt if not added else np.zeros(3))
            name = f"{kind} {len(added)}"
            joint = Joint(name, parent, tuple(axis), _exact(np.zeros(3)), inclined, None, None, type=kind)  # type: ignore[arg-type]
            added.append(joint)
            parent = name
    transducer = replace(rig.transducer, on=parent, tilt=_exact(np.zeros(2)), stiffness=None)
    return replace(rig, joints=(*added, *rig.joints), transducer=transducer)


def _exact(value: Array) -> Quantity:
    return Quantity("", value, "", np.zeros_like(value), "")
