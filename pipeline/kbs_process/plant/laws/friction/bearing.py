"""Dynamic friction of the wave generator's elliptical bearing, with its twice-a-turn fluctuation."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Parameter, Port, amplitude, critical, phase


def torque(rotor_angle: float, rotor_rate: float, d0: float, d1: float, phi_dyn: float, w_dyn: float) -> float:
    r"""Torque on the rotor by the resistance of the elliptical bearing.

    Equation: $T = -(d_0 + d_1 \sin(2 \theta_r + \phi_{dyn})) \min(|\omega_r|/w_{dyn}, 1)
        \operatorname{sign}(\omega_r)$.
    Units: rad, rad/s, N m, N m, rad, rad/s -> N m.
    Validity: passive only while d1 <= d0.
    Source: ENVISAT Ka-band subsystem: Measurement and prediction of the performance of a satellite based antenna
        pointing mechanism and controller, Trans. Built Environment 19 (1996), section 5, dynamic friction.
    """
    resistance = d0 + d1 * math.sin(2.0 * rotor_angle + phi_dyn)
    return -resistance * max(-1.0, min(1.0, rotor_rate / w_dyn))


DYNAMIC_FRICTION = Effect(
    "dynamic_friction",
    Port.MOTOR_TORQUE,
    torque,
    (
        amplitude("d0", "N m", LogNormal(0.012, 0.25), "mean resistance torque", (0.0, 1.0), dry=True),
        critical(amplitude("d1", "N m", LogNormal(0.006, 0.25), "its twice-a-turn fluctuation", (0.0, 1.0), dry=True)),
        critical(phase("phi_dyn", "its phase")),
        Parameter("w_dyn", "rad/s", LogNormal(0.05, 0.2), "rate of full resistance", (1e-4, 10.0)),
    ),
    passive=True,
    family="friction",
    periods=2.0,
    order=40,
)
