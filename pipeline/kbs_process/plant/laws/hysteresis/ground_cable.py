"""Cable from the laboratory to a link: a curved spring with friction between its wires."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, State


def torque(
    joint_angle: float,
    joint_rate: float,
    cable_bend: float,
    cable_offset: float,
    cable_spring: float,
    cable_curve: float,
    cable_cubic: float,
    cable_taut: float,
    cable_friction: float,
    cable_middle: float,
    cable_reach: float,
    cable_memory: float,
) -> tuple[float, float]:
    r"""Torque on the output, reacted by the laboratory.

    Equation: with $u = \theta_l - \theta_m$, $T = T_0 - k u - k_2 u^2 - k_3 u^3 - T_s \tanh(u / u_s) - T_h z$,
        $\dot z = (\omega_l - |\omega_l| z) / x_0$.
    Units: rad, rad/s, 1, N m, N m/rad, N m/rad^2, N m/rad^3, N m (two), rad (three) -> N m, 1/s.
    Validity: its force beside the torque about the joint's axis is left out. The series holds where the joint has been.
    Source: Y. K. Wen, Method for random vibration of hysteretic systems, J. Engineering Mechanics Division ASCE 102
        (1976) 249, with exponent 1 and equal shape factors, which is Dahl's law.
    """
    bent = joint_angle - cable_middle
    spring = cable_offset - bent * (cable_spring + bent * (cable_curve + bent * cable_cubic))
    spring = spring - cable_taut * math.tanh(bent / cable_reach)
    rate = (joint_rate - abs(joint_rate) * cable_bend) / cable_memory
    return spring - cable_friction * cable_bend, rate


GROUND_CABLE = Effect(
    name="ground_cable",
    order=360,
    port=Port.GROUND_TORQUE,
    equation=torque,
    parameters=(
        Parameter("cable_offset", "N m", Normal(0.0, 1.0), "torque in the middle", (-100.0, 100.0), role="amplitude"),
        Parameter("cable_spring", "N m/rad", Normal(0.0, 3.0), "stiffness", (-1e3, 1e3), role="amplitude"),
        Parameter("cable_curve", "N m/rad^2", Normal(0.0, 3.0), "its slope", (-1e4, 1e4), role="amplitude"),
        Parameter("cable_cubic", "N m/rad^3", Normal(0.0, 10.0), "its curvature", (-1e5, 1e5), role="amplitude"),
        Parameter("cable_taut", "N m", Normal(0.0, 1.0), "at which it yields", (-100.0, 100.0), role="amplitude"),
        Parameter(
            "cable_friction", "N m", Normal(0.0, 0.5), "between its wires", (-100.0, 100.0), role="amplitude", dry=True
        ),
        Parameter(
            "cable_middle",
            "rad",
            Normal(0.0, 3.0),
            "angle of the series, and where it yields",
            (-1e2, 1e2),
            grid=(0.2, 0.5, 0.8),
            over="joint_angle",
        ),
        Parameter(
            "cable_reach",
            "rad",
            LogNormal(0.3, 1.0),
            "angle over which it yields",
            (1e-4, 30.0),
            grid=(0.05, 0.2),
            over="joint_angle.span",
        ),
        Parameter(
            "cable_memory",
            "rad",
            LogNormal(0.05, 1.0),
            "angle after a reversal over which friction builds up",
            (1e-4, 3.0),
            grid=(0.01, 0.05, 0.2),
        ),
    ),
    reference="Y. K. Wen, Method for random vibration of hysteretic systems, J. Engineering Mechanics Division ASCE "
    "102 (1976) 249",
    states=(State("cable_bend", "1", 0.0, "share of the friction that is built up"),),
)
