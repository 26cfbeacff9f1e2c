"""Torque of a joint that is periodic in its own angle."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, Normal, Parameter, Port


def torque(joint_angle: float, joint_sin: float, joint_cos: float, joint_order: float) -> float:
    r"""Torque on the output, reacted by the body that carries the motor.

    Equation: $T = a \sin(k \theta_l) + b \cos(k \theta_l)$.
    Units: rad, N m, N m, 1 -> N m.
    Validity: does not depend on rate. 1, 2: seats of the bearings; 200: teeth of the flexspline, 202: of its ring. A
        part of a period is any curve, and is not looked for.
    Source: T. D. Tuttle, W. P. Seering, A nonlinear model of a harmonic drive gear transmission, IEEE Trans. Robotics
        and Automation 12 (1996) 368.
    """
    return joint_sin * math.sin(joint_order * joint_angle) + joint_cos * math.cos(joint_order * joint_angle)


JOINT_ORDER = Effect(
    name="joint_order",
    order=330,
    port=Port.JOINT_TORQUE,
    equation=torque,
    parameters=(
        Parameter(
            "joint_sin", "N m", Normal(0.0, 0.2), "sine of the order", (-100.0, 100.0), role="amplitude", dry=True
        ),
        Parameter(
            "joint_cos", "N m", Normal(0.0, 0.2), "cosine of the order", (-100.0, 100.0), role="amplitude", dry=True
        ),
        Parameter(
            "joint_order",
            "1",
            Normal(1.0, 100.0),
            "periods in a turn of the joint",
            (0.0, 1e4),
            grid=(1.0, 2.0, 3.0, 4.0, 6.0, 200.0, 202.0),
            over="joint_angle.turns",
        ),
    ),
    reference="T. D. Tuttle, W. P. Seering, A nonlinear model of a harmonic drive gear transmission, IEEE Trans. "
    "Robotics and Automation 12 (1996) 368",
)
