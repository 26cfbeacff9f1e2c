"""Kinematic error of the Harmonic Drive: its output is not exactly the motor's angle over the ratio."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, Normal, Parameter, Port, shared, sine_and_cosine
from kbs_process.plant.laws.gear.flexspline import FLEXSPLINE


def slope(rotor_angle: float, kinematic_sin: float, kinematic_cos: float, kinematic_order: float) -> float:
    """Return what the output turns for the rotor beyond 1/ratio: the derivative of the error in `torque`, 1."""
    angle = kinematic_order * rotor_angle
    return kinematic_order * (kinematic_sin * math.cos(angle) - kinematic_cos * math.sin(angle))


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

    Equation: $e = a \sin k \theta_r + b \cos k \theta_r$, $T = K_a e + f_{sv} \dot e$. By virtual work the rotor bears
        $de/d\theta_r$ of the gear's whole torque beside the share of 1/R.
    Units: rad, rad/s, rad, rad, 1, N m s/rad, N m/rad -> N m.
    Validity: an error that the load does not change. Suppliers' catalogues give 1 to 1.5 arcmin from peak to peak for
        such gears, amplitudes of 1.5e-4 to 2.2e-4 rad, most of it k = 2. Nothing is known of the phase, so that a prior
        of both numbers is 0 +- 1.5e-4 rad.
    Source: F. H. Ghorbel, P. S. Gandhi, F. Alpeter, On the kinematic error in harmonic drive gears, J. Mechanical
        Design 123 (2001) 90.
    """
    angle = kinematic_order * rotor_angle
    error = kinematic_sin * math.sin(angle) + kinematic_cos * math.cos(angle)
    return Ka * error + fsv * slope(rotor_angle, kinematic_sin, kinematic_cos, kinematic_order) * rotor_rate


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
    slope=slope,
    order=190,
)
