"""What accelerometer and gyro read, against closed forms of a turning arm."""

from __future__ import annotations

import numpy as np
import pytest

import archived
from kbs_process.plant.inertial import reading
from kbs_process.plant.rigid import LinkMotion
from kbs_process.rig.model import Inertial, Quantity
from kbs_process.signals.frames import about_axis
from kbs_process.signals.records import Array

G, R = 9.80665, np.array([0.3, 0.0, 0.1])
QUARTER = np.array([0.0, 0.0, np.pi / 2.0])  # its x along the link's y


def instrument(attitude: Array, position: Array | None = None) -> Inertial:
    def known(x: Array) -> Quantity:
        return Quantity("", x, "", np.zeros_like(x), "")

    return Inertial("arm", known(attitude), known(np.zeros(())), None if position is None else known(position))


def turning(q: float, rate: float, acceleration: float) -> LinkMotion:
    """An arm about the vertical axis."""
    z, still = np.array([[0.0, 0.0, 1.0]]), np.zeros((1, 3))
    return LinkMotion(
        R=about_axis(z[0], np.array([q])),
        r=still,
        arm=still,
        axis=z,
        v=still,
        omega=rate * z,
        alpha=acceleration * z,
        accel=G * z,
    )


def test_at_rest_an_accelerometer_reads_g_upwards_and_a_gyro_nothing() -> None:
    link = turning(1.0, 0.0, 0.0)
    assert reading(link, instrument(QUARTER, R)) == pytest.approx(np.array([[0.0, 0.0, G]]), abs=1e-12)
    assert reading(link, instrument(QUARTER)) == pytest.approx(np.zeros((1, 3)))


def test_a_turning_arm_is_read_along_it_and_across() -> None:
    """-w^2 r towards the axis and w' r along the way, whatever the angle; the instrument's x is the arm's y."""
    rate, acceleration = 2.0, 3.0
    link = turning(0.7, rate, acceleration)
    along, across = -(rate**2) * R[0], acceleration * R[0]
    assert reading(link, instrument(QUARTER, R))[0] == pytest.approx([across, -along, G])
    assert reading(link, instrument(QUARTER))[0] == pytest.approx([0.0, 0.0, rate])


def test_instruments_are_no_quantities_of_the_article() -> None:
    rig = archived.rig()
    assert not rig.instruments
    rig.instruments["gyro"] = instrument(QUARTER)
    try:
        assert not [name for name in rig.quantities() if name.startswith(("gyro", "instruments"))]
    finally:
        rig.instruments.clear()
