"""Kinematic error of the Harmonic Drive: its output is not exactly the motor's angle over the ratio."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, Normal, Parameter, Port, shared, sine_and_cosine
from kbs_process.plant.laws.gear.flexspline import FLEXSPLINE


def torque(
    rotor_angle: float,
    rotor_rate: float,
    kinematic_sin: float,
    kinematic_cos: float,
    kinematic_order: float,
    fsv: float,
    Ka: float,
) -> float:
    r"""Torque of the gear on the output by an error of its angle, periodic in the wave generator's.

    Equation: $e = a \sin k \theta_r + b \cos k \theta_r$, $T = K_a e + f_{sv} \dot e$.
    Units: rad, rad/s, rad, rad, 1, N m s/rad, N m/rad -> N m.
    Validity: the torque by which the load on a sloping error turns the rotor, $T_{gear} de/d\theta_r$, is left out: a
        fifth of this one's reaction at a load of 10 N m, k = 2.
    Source: F. H. Ghorbel, P. S. Gandhi, F. Alpeter, On the kinematic error in harmonic drive gears, J. Mechanical
        Design 123 (2001) 90.
    """
    sine = math.sin(kinematic_order * rotor_angle)
    cosine = math.cos(kinematic_order * rotor_angle)
    error = kinematic_sin * sine + kinematic_cos * cosine
    slope = kinematic_order * (kinematic_sin * cosine - kinematic_cos * sine)
    return Ka * error + fsv * slope * rotor_rate


KINEMATIC_ERROR = Effect(
    "kinematic_error",
    Port.TRANSMISSION,
    torque,
    (
        *sine_and_cosine("kinematic", "rad", Normal(0.0, 5e-4), "of the error", 0.01),
        Parameter(
            "kinematic_order",
            "1",
            Normal(2.0, 2.0),
            "periods in a turn of the wave generator",
            (0.0, 1e3),
            grid=(1.0, 2.0, 3.0, 4.0, 6.0, 8.0),
            proposed="motor order",
            whole=True,
        ),
        shared(FLEXSPLINE, "fsv"),
        shared(FLEXSPLINE, "Ka"),
    ),
    family="transmission error",
    order=190,
)
