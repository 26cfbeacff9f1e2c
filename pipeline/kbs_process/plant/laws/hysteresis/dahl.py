"""Friction of a joint with its elastic displacement before it slides."""

from __future__ import annotations

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, State


def torque(joint_rate: float, dahl_strain: float, dahl: float, dahl_displacement: float) -> tuple[float, float]:
    r"""Torque on the output, reacted by the body that carries the motor.

    Equation: $T = -T_c z$, $\dot z = (\omega_l - |\omega_l| z) / x_0$.
    Units: rad/s, 1, N m, rad -> N m, 1/s.
    Validity: does not depend on rate; |z| <= 1. Bearings roll within 0.3 deg of a reversal; what slides later is
        `joint_hysteresis`. The greatest rate in a step has to stay below x0.
    Source: P. R. Dahl, A solid friction model, Aerospace Corp. TOR-0158(3107-18)-1 (1968).
    """
    return -dahl * dahl_strain, (joint_rate - abs(joint_rate) * dahl_strain) / dahl_displacement


DAHL = Effect(
    name="dahl",
    order=290,
    port=Port.JOINT_TORQUE,
    equation=torque,
    parameters=(
        Parameter("dahl", "N m", Normal(0.0, 0.5), "friction torque", (-100.0, 100.0), role="amplitude", dry=True),
        Parameter(
            "dahl_displacement",
            "rad",
            LogNormal(1e-3, 1.0),
            "angle after a reversal over which it builds up",
            (1e-5, 5e-3),
            grid=(2e-4, 1e-3),
        ),
    ),
    reference="P. R. Dahl, A solid friction model, Aerospace Corp. TOR-0158(3107-18)-1 (1968)",
    states=(State("dahl_strain", "1", 0.0, "bristles' deflection over its greatest"),),
)
