"""Harness or cable drum across a joint: a curved spring with friction between its wires."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, State


def torque(
    joint_angle: float,
    joint_rate: float,
    harness_bend: float,
    harness_offset: float,
    harness_spring: float,
    harness_curve: float,
    harness_cubic: float,
    harness_taut: float,
    harness_friction: float,
    harness_middle: float,
    harness_reach: float,
    harness_memory: float,
) -> tuple[float, float]:
    r"""Torque on the output, reacted by the body that carries the motor.

    Equation: with $u = \theta_l - \theta_m$, $T = T_0 - k u - k_2 u^2 - k_3 u^3 - T_s \tanh(u / u_s) - T_h z$,
        $\dot z = (\omega_l - |\omega_l| z) / x_0$.
    Units: rad, rad/s, 1, N m, N m/rad, N m/rad^2, N m/rad^3, N m (two), rad (three) -> N m, 1/s.
    Validity: internal, so it shows in the windup and leaves no wrench of its own. The series holds where the joint has
        been.
    Source: Y. K. Wen, Method for random vibration of hysteretic systems, J. Engineering Mechanics Division ASCE 102
        (1976) 249, with exponent 1 and equal shape factors, which is Dahl's law.
    """
    bent = joint_angle - harness_middle
    spring = harness_offset - bent * (harness_spring + bent * (harness_curve + bent * harness_cubic))
    spring = spring - harness_taut * math.tanh(bent / harness_reach)
    rate = (joint_rate - abs(joint_rate) * harness_bend) / harness_memory
    return spring - harness_friction * harness_bend, rate


HARNESS = Effect(
    name="harness",
    order=310,
    port=Port.JOINT_TORQUE,
    equation=torque,
    parameters=(
        Parameter("harness_offset", "N m", Normal(0.0, 1.0), "torque in the middle", (-100.0, 100.0), role="amplitude"),
        Parameter("harness_spring", "N m/rad", Normal(0.0, 3.0), "stiffness", (-1e3, 1e3), role="amplitude"),
        Parameter("harness_curve", "N m/rad^2", Normal(0.0, 3.0), "its slope", (-1e4, 1e4), role="amplitude"),
        Parameter("harness_cubic", "N m/rad^3", Normal(0.0, 10.0), "its curvature", (-1e5, 1e5), role="amplitude"),
        Parameter("harness_taut", "N m", Normal(0.0, 1.0), "at which it yields", (-100.0, 100.0), role="amplitude"),
        Parameter(
            "harness_friction",
            "N m",
            Normal(0.0, 0.5),
            "between its wires",
            (-100.0, 100.0),
            role="amplitude",
            dry=True,
        ),
        Parameter(
            "harness_middle",
            "rad",
            Normal(0.0, 3.0),
            "angle of the series, and where it yields",
            (-1e2, 1e2),
            grid=(0.2, 0.5, 0.8),
            over="joint_angle",
        ),
        Parameter(
            "harness_reach",
            "rad",
            LogNormal(0.3, 1.0),
            "angle over which it yields",
            (1e-4, 30.0),
            grid=(0.05, 0.2),
            over="joint_angle.span",
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
