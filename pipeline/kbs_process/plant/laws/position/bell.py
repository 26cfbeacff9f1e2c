"""Torque of a joint at one place: a kinked harness, a damaged bearing, something of the laboratory that it touches."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, Normal, Port, amplitude, wired
from kbs_process.plant.laws.position.place import place, width


def torque(joint_angle: float, height: float, angle: float, spread: float) -> float:
    r"""Torque on the output, reacted by the body that carries the motor, or by the laboratory.

    Equation: $T = T_0 \exp(-((\theta_l - \theta_0) / w)^2 / 2)$.
    Units: rad, N m, rad, rad -> N m.
    Validity: the same in both senses of rotation.
    Source: C. M. Bishop, Pattern Recognition and Machine Learning (2006), section 3.1: a Gaussian basis function.
    """
    away = (joint_angle - angle) / spread
    return height * math.exp(-0.5 * away * away)


def _bell(name: str, stem: str, port: Port, order: int) -> Effect:
    return Effect(
        name,
        port,
        torque,
        (
            amplitude(stem, "N m", Normal(0.0, 0.5), "greatest torque", 100.0),
            place(f"{stem}_angle", "angle of the greatest torque", 12),
            width(f"{stem}_width", "its standard width", 0.03, (0.03, 0.08)),
        ),
        wires=wired(height=stem, angle=f"{stem}_angle", spread=f"{stem}_width"),
        family="local torque",
        order=order,
    )


LOCAL_TORQUE = _bell("local_torque", "local", Port.JOINT_TORQUE, 340)
GROUND_BUMP = _bell("ground_bump", "touch", Port.GROUND_TORQUE, 370)
