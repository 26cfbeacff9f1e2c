"""Torque of the hybrid stepper motor, run as a synchronous motor by microsteps."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port


def torque(field: float, rotor_angle: float, Tmax: float, Kangle: float) -> float:
    r"""Torque on the rotor by the magnetic field.

    Equation: $T = T_{max} \sin(K_{angle} (\theta_f - \theta_r))$. With 200 steps of 64 microsteps a turn,
        $K_{angle} \theta_f$ is $\pi/64$ times the whole number of microsteps.
    Units: rad, rad, N m, 1 -> N m.
    Validity: current-controlled windings, no saturation, no step lost: load below Tmax.
    Source: ENVISAT Ka-band subsystem: Measurement and prediction of the performance of a satellite based antenna
        pointing mechanism and controller, Trans. Built Environment 19 (1996), section 5, synchronous torque.
    """
    return Tmax * math.sin(Kangle * (field - rotor_angle))


SYNCHRONOUS_MOTOR = Effect(
    "synchronous_motor",
    Port.MOTOR_TORQUE,
    torque,
    (
        Parameter("Tmax", "N m", LogNormal(0.35, 0.06), "greatest synchronous torque", (1e-3, 10.0)),
        Parameter("Kangle", "1", Normal(100.0, 0.0), "electrical cycles in a motor turn", (1.0, 1e4)),
    ),
    order=10,
)
