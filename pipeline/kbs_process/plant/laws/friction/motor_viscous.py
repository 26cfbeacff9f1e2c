"""Viscous friction of the motor."""

from __future__ import annotations

from kbs_process.plant.effect import Effect, LogNormal, Parameter, Port


def torque(rotor_rate: float, b_m: float) -> float:
    r"""Torque on the rotor by viscous friction and eddy currents.

    Equation: $T = -b_m \omega_r$.
    Units: rad/s, N m s/rad -> N m.
    Validity: constant temperature of the lubricant.
    Source: ENVISAT Ka-band subsystem (1996), section 5, motor friction.
    """
    return -b_m * rotor_rate


MOTOR_VISCOUS = Effect(
    name="motor_viscous",
    order=30,
    port=Port.MOTOR_TORQUE,
    equation=torque,
    parameters=(
        Parameter(
            "b_m",
            "N m s/rad",
            LogNormal(2e-3, 0.2),
            "viscous friction of the motor",
            bounds=(0.0, 1.0),
            role="amplitude",
        ),
    ),
    reference="Measurement and prediction of the performance of a satellite based antenna pointing mechanism "
    "and controller, Trans. Built Environment 19 (1996), section 5",
    passive=True,
)
