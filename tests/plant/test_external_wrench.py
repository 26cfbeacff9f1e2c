"""The static wrench of a cord that is taken from recordings, against the plant at rest and against geometry."""

from __future__ import annotations

import numpy as np
import pytest

from kbs_process.plant.attach import attach
from kbs_process.plant.compiled.simulation import Simulation
from kbs_process.plant.external import external_wrench
from kbs_process.plant.laws import select
from kbs_process.plant.laws.environment.bungee import BUNGEE
from kbs_process.plant.schedule import Schedule
from kbs_process.rig.model import Rig, substitute
from kbs_process.signals.records import Array
from plant.plant_rigs import NOMINAL, two_axis

COG = np.array([0.07, 0.06, -0.02])
CORD = {"stiffness": 60.0, "free_length": 0.7117, "anchor_x": 0.07, "anchor_y": 0.06, "anchor_z": 3.2}


def equilibrium(of: Rig, effects: tuple[str, ...], position: Array) -> Simulation:
    schedule = Schedule(np.array([0.0, 0.1]), np.tile(position, (2, 1)), np.zeros((2, 2)))
    return Simulation(of, select(effects), schedule, step=1e-3, per_sample=1, angle_rate=1.0, end=1.0)


@pytest.mark.parametrize("azimuth", [-12.0, 12.0])
def test_as_the_plant_at_rest(azimuth: float) -> None:
    """On the elastic transducer, where the cord changes the sag and the sag the weight's moment."""
    of = two_axis(amplifier=None, tilt=(2e-3, -1e-3))
    of = substitute(of, {f"joint.{name}.drive.parameters.tcog": 0.0 for name in of.joint_names})
    hung, slack = (attach(of, BUNGEE, CORD | change, on="el", point=COG) for change in ({}, {"stiffness": 0.0}))
    position = np.radians([azimuth, 0.0])
    with_cord, without = (equilibrium(each, (*NOMINAL, "bungee"), position) for each in (hung, slack))
    # The plant's joints yield to the cord: each at its own angles.
    at = np.array([with_cord.part("q"), without.part("q")])
    found = external_wrench(hung, (BUNGEE,), at)[0]
    weight = equilibrium(slack, (*NOMINAL, "bungee"), position).wrench
    change = with_cord.wrench - weight
    print("plant", change, "\nstatic", found)
    np.testing.assert_allclose(found[:3], change[:3], atol=5e-3)
    # The rest is the weight's moment along the gear's windup of 1 mrad, 14 kg at 0.09 m.
    np.testing.assert_allclose(found[3:], change[3:], atol=2e-2)
    assert np.abs(change[2]) > 130.0


def test_swings_as_a_pendulum() -> None:
    """Azimuth to either side of where the cord is plumb: a pull back of F s / l."""
    of = attach(two_axis(stiffness=None), BUNGEE, CORD, on="el", point=COG)
    q = np.radians([[-12.0, 0.0], [0.0, 0.0], [12.0, 0.0]])
    found = external_wrench(of, (BUNGEE,), q)
    plumb = CORD["stiffness"] * (3.0 - CORD["free_length"])
    np.testing.assert_allclose(found[1, :3], [0.0, 0.0, plumb], rtol=1e-9, atol=1e-9)
    sideways = [COG[0] * np.cos(q[2, 0]) - COG[1] * np.sin(q[2, 0]) - COG[0],
                COG[0] * np.sin(q[2, 0]) + COG[1] * np.cos(q[2, 0]) - COG[1]]  # fmt: skip
    np.testing.assert_allclose(found[2, :2], -plumb / 3.0 * np.array(sideways), rtol=1e-3)
    assert np.all(external_wrench(of, select(NOMINAL), q) == 0.0)
