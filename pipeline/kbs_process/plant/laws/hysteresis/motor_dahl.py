"""Friction of the motor's bearings with their elastic displacement before they slide."""

from __future__ import annotations

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, State


def torque(
    rotor_rate: float, presliding_strain: float, presliding: float, presliding_angle: float
) -> tuple[float, float]:
    r"""Torque on the rotor.

    Equation: $T = -T_c z$, $\dot z = (\omega_r - |\omega_r| z) / x_0$.
    Units: rad/s, 1, N m, rad -> N m, 1/s.
    Validity: does not depend on rate; |z| <= 1. What the rotor turns in a step has to stay below x0.
    Source: P. R. Dahl, A solid friction model, Aerospace Corp. TOR-0158(3107-18)-1 (1968).
    """
    turned = (rotor_rate - abs(rotor_rate) * presliding_strain) / presliding_angle
    return -presliding * presliding_strain, turned


MOTOR_DAHL = Effect(
    name="motor_dahl",
    order=180,
    port=Port.MOTOR_TORQUE,
    equation=torque,
    parameters=(
        Parameter("presliding", "N m", Normal(0.0, 5e-3), "friction torque", (-10.0, 10.0), role="amplitude", dry=True),
        Parameter(
            "presliding_angle",
            "rad",
            LogNormal(0.05, 1.0),
            "of the motor, after a reversal, over which it builds up",
            (5e-3, 10.0),
            grid=(0.02, 0.1, 0.5),
        ),
    ),
    reference="P. R. Dahl, A solid friction model, Aerospace Corp. TOR-0158(3107-18)-1 (1968)",
    states=(State("presliding_strain", "1", 0.0, "bristles' deflection over its greatest"),),
)
