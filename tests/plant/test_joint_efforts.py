"""Efforts of joints that turn and slide, against the work that they do; effects along a measured motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kbs_process.plant.attach import attach
from kbs_process.plant.laws.friction.coulomb import COULOMB
from kbs_process.plant.laws.position.order import JOINT_ORDER
from kbs_process.plant.moved import added_loads
from kbs_process.plant.rigid import inertia_matrix, inverse_dynamics, joint_efforts, kinematics, loads
from kbs_process.rig.model import Effort, Rig, no_transducer
from kbs_process.signals.averages import instants
from kbs_process.signals.frames import rotate
from plant.rigs import body, joint, pointing_rig, quantity, smooth_motion

G = 9.80665


def effort(name, unit="N", gain=1.0, bias=0.0):
    at = f"joint.{name}.effort"
    return Effort(
        unit,
        quantity(f"{at}.gain", gain),
        quantity(f"{at}.bias", bias),
        quantity(f"{at}.noise", 0.1),
        quantity(f"{at}.resolution", 0.0),
    )


def slide(*args, viscous=None, measured=None, **kwargs):
    made = joint(*args, **kwargs)
    friction = None if viscous is None else quantity(f"joint.{made.name}.viscous", viscous)
    return replace(made, type="prismatic", viscous=friction, effort=measured)


def gantry():
    """A slide along a tilted axis, a turning arm on it, and a slide along the arm."""
    return Rig(
        quantity("gravity.magnitude", G),
        no_transducer(),
        (
            body("car", "x", 5.0, [0.1, 0.0, 0.2], [0.1, 0.2, 0.3, 0.01, 0.0, 0.02]),
            body("arm", "turn", 3.0, [0.05, 0.3, -0.1], [0.2, 0.1, 0.15, 0.0, 0.01, 0.0]),
            body("tool", "reach", 2.0, [0.0, 0.1, 0.05], [0.02, 0.03, 0.01, 0.0, 0.0, 0.0]),
        ),
        (
            slide("x", "lab", (0.8, 0.0, 0.6)),
            joint("turn", "x", (0.0, 0.6, 0.8), (0.1, 0.2, 0.3), mis=(0.02, -0.01, 0.03)),
            slide("reach", "turn", (0.0, 1.0, 0.0), (0.2, 0.0, 0.1)),
        ),
        None,
        None,
    )


def energy(rig, q, qd, dt):
    """Kinetic and potential energy (n,), speeds of the CoGs by differences of their places."""
    links = kinematics(rig, q, qd, np.zeros_like(q))
    total = np.zeros(len(q))
    for one in rig.bodies:
        link = links[one.on]
        place = link.r + rotate(link.R, one.cog.value)
        velocity = np.gradient(place, dt, axis=0)
        tensor = link.R @ inertia_matrix(one.inertia.value) @ np.swapaxes(link.R, 1, 2)
        total += float(one.mass) * (0.5 * np.sum(velocity**2, axis=1) + G * place[:, 2])
        total += 0.5 * np.sum(link.omega * rotate(tensor, link.omega), axis=1)
    return total


def test_efforts_do_the_work_that_the_energy_gains():
    rig = gantry()
    t, q, qd, qdd = smooth_motion(3, seconds=5.0, rate=2000.0, seed=4)
    dt = t[1] - t[0]
    gained = np.gradient(energy(rig, q, qd, dt), dt)
    power = np.sum(joint_efforts(rig, q, qd, qdd) * qd, axis=1)
    inner = slice(5, -5)
    np.testing.assert_allclose(power[inner], gained[inner], atol=2e-4 * np.abs(gained).max())


def test_the_outermost_slide_carries_its_own_weight_and_mass():
    rig = gantry()
    q, qd, qdd = (np.array([row]) for row in ([0.3, 0.4, 0.1], [0.0, 0.0, 0.0], [0.0, 0.0, 1.5]))
    axis = kinematics(rig, q, qd, qdd)["reach"].R[0] @ [0.0, 1.0, 0.0]
    assert joint_efforts(rig, q, qd, qdd)[0, 2] == pytest.approx(2.0 * (1.5 + G * axis[2]))


def test_wrench_of_a_pointing_mechanism_holds_what_its_azimuth_drive_puts_in():
    """About the azimuth axis the transducer feels the reaction of the drive, and of the rotor that the drive turns."""
    rig = pointing_rig(stiffness=None, rotor=None)
    rig = replace(rig, joints=tuple(replace(one, misalignment=quantity("m", [0.0] * 3)) for one in rig.joints))
    _, q, qd, qdd = smooth_motion(2)
    torque = inverse_dynamics(rig, q, qd, qdd)[:, 5]
    np.testing.assert_allclose(joint_efforts(rig, q, qd, qdd)[:, 0], -torque, atol=1e-12)


def test_a_reading_is_effort_over_gain_friction_included():
    made = slide("axis", "lab", (1, 0, 0), viscous=40.0, measured=effort("axis", "A", gain=20.0, bias=0.5))
    rig = Rig(
        quantity("gravity.magnitude", G),
        no_transducer(),
        (body("car", "axis", 10.0, [0, 0, 0], [0] * 6),),
        (made,),
        None,
        None,
    )
    assert (rig.channels, rig.frame) == (("axis.effort",), "joint")
    read = loads(rig, np.zeros((1, 1)), np.array([[0.3]]), np.array([[2.0]]))
    np.testing.assert_allclose(read, [[0.0] * 6 + [(10.0 * 2.0 + 40.0 * 0.3) / 20.0 + 0.5]])
    assert "transducer.tilt" not in rig.quantities()


def _driven(gain):
    made = replace(joint("axis", "lab", (0, 0, 1)), effort=effort("axis", "A", gain=gain))
    return Rig(quantity("gravity.magnitude", G), no_transducer(), (), (made,), None, None)


def test_effects_along_a_motion_are_read_with_the_drives_sign():
    rig = attach(_driven(gain=0.5), JOINT_ORDER, {"joint_sin": 0.2, "joint_order": 3.0})
    rig = attach(rig, COULOMB, {"coulomb": 0.1})
    dt = 0.01
    t = dt * np.arange(1000)
    angle = 2.0 * np.sin(0.5 * t)
    added = added_loads(rig, [JOINT_ORDER, COULOMB], angle[:, None], np.gradient(angle, dt)[:, None], dt)
    expected = -(0.2 * np.sin(3.0 * angle) - 0.1 * np.sign(np.cos(0.5 * t))) / 0.5
    moving = np.abs(np.cos(0.5 * t)) > 0.2
    moving[:20] = moving[-20:] = False
    np.testing.assert_allclose(added[moving, 6], expected[moving], atol=8e-3)
    assert not added[:, :6].any()


def test_an_effect_of_a_slide_has_newtons_and_metres():
    made = slide("axis", "lab", (1, 0, 0), measured=effort("axis"))
    rig = attach(replace(_driven(1.0), joints=(made,)), COULOMB, {"coulomb": 20.0})
    quantities = rig.quantities()
    assert quantities["joint.axis.drive.coulomb"].unit == "N"
    assert quantities["joint.axis.drive.coulomb_rate"].unit == "m/s"


@pytest.mark.parametrize("f", [0.5, 5.0, 20.0])
def test_means_give_back_what_they_are_means_of(f):
    dt = 0.01
    edges = dt * np.arange(601)
    means = -np.diff(np.cos(2 * np.pi * f * edges)) / (2 * np.pi * f * dt)
    inner = slice(100, -100)
    np.testing.assert_allclose(instants(means)[inner], np.sin(2 * np.pi * f * edges[:-1])[inner], atol=2e-2)
