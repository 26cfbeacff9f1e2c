"""A joint's rotation as the compiled plant takes it, against rotations composed one by one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from plant_rigs import joint

from kbs_process.plant.structure import turn
from kbs_process.rig.model import Quantity
from kbs_process.signals.frames import about_axis, from_rotation_vector


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
