"""Friction of the motor that fluctuates with the rotor's angle."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, sine_and_cosine


def torque(
    rotor_angle: float, rotor_rate: float, ripple_sin: float, ripple_cos: float, ripple_order: float, ripple_rate: float
) -> float:
    r"""Torque on the rotor by the fluctuation of a friction about its mean.

    Equation: $T = -(a \sin k \theta_r + b \cos k \theta_r) \max(-1, \min(1, \omega_r / \omega_0))$.
    Units: rad, rad/s, N m, N m, 1, rad/s -> N m.
    Validity: a fluctuation alone is not passive; with a mean friction above its amplitude the sum is.
    Source: T. D. Tuttle, W. P. Seering, A nonlinear model of a harmonic drive gear transmission, IEEE Trans. Robotics
        and Automation 12 (1996) 368.
    """
    resistance = ripple_sin * math.sin(ripple_order * rotor_angle) + ripple_cos * math.cos(ripple_order * rotor_angle)
    return -resistance * max(-1.0, min(1.0, rotor_rate / ripple_rate))


FRICTION_RIPPLE = Effect(
    "friction_ripple",
    Port.MOTOR_TORQUE,
    torque,
    (
        *sine_and_cosine("ripple", "N m", Normal(0.0, 3e-3), "of the order", 1.0, dry=True),
        Parameter(
            "ripple_order",
            "1",
            Normal(2.0, 100.0),
            "periods in a turn of the motor",
            (0.0, 1e4),
            grid=(1.0, 2.0, 4.0, 6.0, 8.0, 100.0, 200.0),
            proposed="motor order",
            whole=True,
        ),
        Parameter("ripple_rate", "rad/s", LogNormal(0.05, 0.2), "rate of full resistance", (1e-4, 10.0)),
    ),
    family="motor order",
    order=130,
)
