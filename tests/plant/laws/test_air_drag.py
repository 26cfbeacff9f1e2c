"""Drag on an area: against closed forms of a point on a circle, and along a measured motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kbs_process.plant.attach import attach
from kbs_process.plant.external import external_efforts, external_wrench, pulls_at_rest
from kbs_process.plant.laws.environment.air_drag import AIR_DRAG, SPEED
from kbs_process.plant.laws.environment.bungee import BUNGEE
from kbs_process.plant.laws.environment.tether import TETHER
from kbs_process.plant.moved import added_loads
from kbs_process.rig.model import Effort, Rig
from kbs_process.signals.records import Array
from plant.plant_rigs import quantity, two_axis

DRAG, RADIUS, SIDE = 0.2, 0.5, 0.12  # N at 0.01 m/s; m from the elevation axis, and along it
HEIGHT = 0.22  # m, of the elevation axis above T
RATE = 0.03  # rad/s


def dragged(power: float = 2.0, drag: float = DRAG, **settings: object) -> Rig:
    settings = {"stiffness": None, "amplifier": None} | settings
    values = {"air_drag": drag, "air_drag_power": power}
    return attach(two_axis(**settings), AIR_DRAG, values, on="el", point=np.array([RADIUS, SIDE, 0.0]))


def at(position: tuple[float, float], rates: tuple[float, float], of: Rig) -> tuple[Array, Array]:
    q, qd = np.radians([position]), np.array([rates])
    return external_wrench(of, (AIR_DRAG,), q, qd)[0], external_efforts(of, (AIR_DRAG,), q, qd)[0]


@pytest.mark.parametrize("power", [1.5, 2.0])
@pytest.mark.parametrize("sense", [-1.0, 1.0])
def test_torque_about_a_joint_is_that_of_a_point_on_a_circle(power: float, sense: float) -> None:
    """c r^(n+1) w^n about the elevation axis, and the force's moments about the others."""
    wrench, efforts = at((0.0, 0.0), (0.0, sense * RATE), dragged(power))
    c = DRAG / SPEED**power
    down = -sense * c * (RADIUS * RATE) ** power  # the boresight rises, the force is against it
    assert efforts[1] == pytest.approx(sense * c * RADIUS ** (power + 1.0) * RATE**power, rel=1e-9)
    np.testing.assert_allclose(wrench, [0.0, 0.0, down, SIDE * down, -RADIUS * down, 0.0], atol=1e-12)


def test_azimuth_moves_the_antennas_area_too() -> None:
    """Level antenna: sideways, about the vertical axis at the point's distance from it; none of it about elevation."""
    wrench, efforts = at((0.0, 0.0), (RATE, 0.0), dragged())
    arm = np.hypot(RADIUS, SIDE)
    size = DRAG / SPEED**2 * (arm * RATE) ** 2
    force = -size * np.array([-SIDE, RADIUS, 0.0]) / arm
    expected = [*force, *np.cross([RADIUS, SIDE, HEIGHT], force)]
    np.testing.assert_allclose(wrench, expected, atol=1e-12)
    assert efforts[0] == pytest.approx(arm * size) and efforts[1] == pytest.approx(0.0, abs=1e-12)


def test_drives_put_in_what_the_air_takes() -> None:
    rng = np.random.default_rng(3)
    q, qd = rng.uniform(-1.5, 1.5, (40, 2)), rng.normal(0.0, RATE, (40, 2))
    power = np.sum(external_efforts(dragged(1.7), (AIR_DRAG,), q, qd) * qd, axis=1)
    assert (power > 0.0).all()
    still = np.zeros_like(qd)
    assert not external_wrench(dragged(), (AIR_DRAG,), q, still).any()
    assert not external_wrench(dragged(), (AIR_DRAG,), q).any()
    assert pulls_at_rest(BUNGEE) and pulls_at_rest(TETHER) and not pulls_at_rest(AIR_DRAG)


def test_measured_motion_shows_it_in_wrench_and_effort() -> None:
    bare = dragged()
    effort = Effort("N m", *(quantity("effort", value) for value in (2.0, 0.0, 0.0, 0.0)))
    joints = (bare.joints[0], replace(bare.joints[1], effort=effort))
    dt = 0.01
    t = dt * np.arange(1000)
    rate = 0.04 * np.cos(0.8 * t)
    q = np.stack([0.0 * t, 0.05 * np.sin(0.8 * t)], axis=1)
    qd = np.stack([0.0 * t, rate], axis=1)
    added = added_loads(replace(bare, joints=joints), (AIR_DRAG,), q, qd, dt)
    moment = DRAG / SPEED**2 * RADIUS**3 * np.abs(rate) * rate
    np.testing.assert_allclose(added[:, 7], moment / 2.0, atol=1e-4 * moment.max())
    assert not added[:, 6].any()
    np.testing.assert_allclose(np.hypot(added[:, 0], added[:, 2])[2:-2], np.abs(moment[2:-2]) / RADIUS, atol=1e-3)
