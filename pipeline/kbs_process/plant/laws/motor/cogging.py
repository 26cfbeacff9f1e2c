"""Cogging (detent) torque of the stepper motor."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Port, amplitude, critical, phase


def torque(rotor_angle: float, tcog: float, phi_cog: float) -> float:
    r"""Torque on the rotor by the teeth of the unexcited motor.

    Equation: $T = t_{cog} \sin(200 \theta_r + \phi_{cog})$, 200 being the full steps in a turn.
    Units: rad, N m, rad -> N m.
    Validity: first harmonic of the detent torque of a 200-step motor.
    Source: ENVISAT Ka-band subsystem: Measurement and prediction of the performance of a satellite based antenna
        pointing mechanism and controller, Trans. Built Environment 19 (1996), section 5, cogging torque.
    """
    return tcog * math.sin(200.0 * rotor_angle + phi_cog)


COGGING = Effect(
    "cogging",
    Port.MOTOR_TORQUE,
    torque,
    (
        critical(
            amplitude("tcog", "N m", LogNormal(6e-3, 0.25), "amplitude of the cogging torque", (0.0, 1.0), dry=True)
        ),
        critical(phase("phi_cog", "phase of cogging")),
    ),
    family="cogging",
    periods=200.0,
    order=20,
)
