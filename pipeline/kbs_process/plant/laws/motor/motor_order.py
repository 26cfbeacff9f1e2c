"""Torque of the motor that is periodic in the rotor's angle, of any order."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, Normal, Parameter, Port


def torque(rotor_angle: float, order_sin: float, order_cos: float, order: float) -> float:
    r"""Torque on the rotor of one order of its angle.

    Equation: $T = a \sin(k \theta_r) + b \cos(k \theta_r)$.
    Units: rad, N m, N m, 1 -> N m.
    Validity: does not depend on rate or current. Whole orders belong to the motor (1: eccentricity, 2: ellipse of the
        wave generator, 50: pole pairs, 200: full steps), others to wheels geared to it.
    Source: T. Kenjo, A. Sugawara, Stepping Motors and Their Microprocessor Controls (1994), chapter 4.
    """
    return order_sin * math.sin(order * rotor_angle) + order_cos * math.cos(order * rotor_angle)


MOTOR_ORDER = Effect(
    name="motor_order",
    order=110,
    port=Port.MOTOR_TORQUE,
    equation=torque,
    parameters=(
        Parameter("order_sin", "N m", Normal(0.0, 5e-3), "sine of the order", (-1.0, 1.0), role="amplitude", dry=True),
        Parameter(
            "order_cos", "N m", Normal(0.0, 5e-3), "cosine of the order", (-1.0, 1.0), role="amplitude", dry=True
        ),
        Parameter(
            "order",
            "1",
            Normal(1.0, 100.0),
            "periods in a turn of the motor",
            (0.0, 1e4),
            grid=(1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 25.0, 50.0, 100.0, 150.0, 200.0, 250.0, 300.0, 400.0, 600.0, 800.0),
        ),
    ),
    reference="T. Kenjo, A. Sugawara, Stepping Motors and Their Microprocessor Controls (1994), chapter 4",
)
