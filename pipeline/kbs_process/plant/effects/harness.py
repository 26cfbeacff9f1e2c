"""Harness or cable drum across a joint: a spring with friction between its wires."""

from __future__ import annotations

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, State


def torque(
    joint_angle: float,
    joint_rate: float,
    harness_bend: float,
    harness_spring: float,
    harness_offset: float,
    harness_friction: float,
    harness_memory: float,
) -> tuple[float, float]:
    r"""Torque on the output, reacted by the body that carries the motor.

    Equation: $T = -k \theta_l + T_0 - T_h z$, $\dot z = (\omega_l - |\omega_l| z) / x_0$.
    Units: rad, rad/s, 1, N m/rad, N m, N m, rad -> N m, 1/s.
    Validity: small bending; internal, so it shows in the windup and leaves no wrench of its own.
    Source: Y. K. Wen, Method for random vibration of hysteretic systems, J. Engineering Mechanics Division ASCE 102
        (1976) 249, with exponent 1 and equal shape factors, which is Dahl's law.
    """
    value = -harness_spring * joint_angle + harness_offset - harness_friction * harness_bend
    return value, (joint_rate - abs(joint_rate) * harness_bend) / harness_memory


HARNESS = Effect(
    name="harness",
    port=Port.JOINT_TORQUE,
    equation=torque,
    parameters=(
        Parameter("harness_spring", "N m/rad", Normal(0.0, 2.0), "stiffness", (-1e3, 1e3), role="amplitude"),
        Parameter(
            "harness_offset",
            "N m",
            Normal(0.0, 1.0),
            "torque at angle zero",
            (-100.0, 100.0),
            role="amplitude",
        ),
        Parameter(
            "harness_friction",
            "N m",
            Normal(0.0, 0.5),
            "between its wires",
            (-100.0, 100.0),
            role="amplitude",
        ),
        Parameter(
            "harness_memory",
            "rad",
            LogNormal(0.05, 1.0),
            "angle after a reversal over which friction builds up",
            (1e-4, 3.0),
            grid=(0.01, 0.05, 0.2),
        ),
    ),
    reference="Y. K. Wen, Method for random vibration of hysteretic systems, J. Engineering Mechanics Division ASCE "
    "102 (1976) 249",
    states=(State("harness_bend", "1", 0.0, "share of the friction that is built up"),),
)
