"""A joint's rotation as the compiled plant takes it, against rotations composed one by one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from kbs_process.plant.rigid import kinematics
from kbs_process.plant.structure import turn
from kbs_process.rig.model import Quantity
from kbs_process.signals.frames import about_axis, from_rotation_vector
from plant.plant_rigs import joint, two_axis


def test_a_joint_turns_about_its_axis_behind_its_misalignment_numbers_read_only() -> None:
    misalignment = np.array([0.01, -0.02, 0.03])
    misalignment.setflags(write=False)
    turning = replace(
        joint("el", "T", (0.0, -1.0, 0.0), [0.0, 0.0, 0.1]),
        misalignment=Quantity("joint.el.misalignment", misalignment, "rad", np.zeros(3), "test"),
    )
    axis, P = turn(turning)
    R = from_rotation_vector(misalignment)
    np.testing.assert_allclose(axis, R @ [0.0, -1.0, 0.0], atol=1e-15)
    for q in (0.0, 0.7, -2.0):
        about = about_axis(np.array([0.0, -1.0, 0.0]), np.array([q]))[0]
        np.testing.assert_allclose(P[0] + P[1] * np.cos(q) + P[2] * np.sin(q), R @ about, atol=1e-15)


def test_a_misalignment_turns_the_link_and_its_axis_before_the_joint_turns() -> None:
    """A rotation vector in the parent's axes, as docs/campaign.md says: large enough that no other order would pass."""
    vector, q = np.array([0.3, -0.5, 0.2]), 0.7
    turned = joint("az", "T", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), misalignment=vector)
    before = Rotation.from_rotvec(vector)
    expected = (before * Rotation.from_rotvec([0.0, 0.0, q])).as_matrix()
    axis, parts = turn(turned)
    np.testing.assert_allclose(parts[0] + np.cos(q) * parts[1] + np.sin(q) * parts[2], expected, atol=1e-14)
    np.testing.assert_allclose(axis, before.apply([0.0, 0.0, 1.0]), atol=1e-14)
    rig = replace(two_axis(), joints=(turned,), bodies=())
    angle, still = np.array([[q]]), np.zeros((1, 1))
    links = kinematics(rig, angle, still, still)
    relative = links["T"].R[0].T @ links["az"].R[0]
    np.testing.assert_allclose(relative, expected, atol=1e-14)
    np.testing.assert_allclose(links["T"].R[0].T @ links[turned.name].axis[0], axis, atol=1e-14)
