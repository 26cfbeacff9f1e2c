"""Cable from the laboratory to a link: a spring with friction between its wires."""

from __future__ import annotations

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, State


def torque(
    joint_angle: float,
    joint_rate: float,
    cable_bend: float,
    cable_spring: float,
    cable_offset: float,
    cable_friction: float,
    cable_memory: float,
) -> tuple[float, float]:
    r"""Torque on the output, reacted by the laboratory.

    Equation: $T = -k \theta_l + T_0 - T_h z$, $\dot z = (\omega_l - |\omega_l| z) / x_0$.
    Units: rad, rad/s, 1, N m/rad, N m, N m, rad -> N m, 1/s.
    Validity: small bending; its force beside the torque about the joint's axis is left out.
    Source: Y. K. Wen, Method for random vibration of hysteretic systems, J. Engineering Mechanics Division ASCE 102
        (1976) 249, with exponent 1 and equal shape factors, which is Dahl's law.
    """
    value = -cable_spring * joint_angle + cable_offset - cable_friction * cable_bend
    return value, (joint_rate - abs(joint_rate) * cable_bend) / cable_memory


GROUND_CABLE = Effect(
    name="ground_cable",
    port=Port.GROUND_TORQUE,
    equation=torque,
    parameters=(
        Parameter("cable_spring", "N m/rad", Normal(0.0, 2.0), "stiffness", (-1e3, 1e3), role="amplitude"),
        Parameter(
            "cable_offset", "N m", Normal(0.0, 1.0), "torque at angle zero", (-100.0, 100.0), role="amplitude"
        ),
        Parameter(
            "cable_friction", "N m", Normal(0.0, 0.5), "between its wires", (-100.0, 100.0), role="amplitude"
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
