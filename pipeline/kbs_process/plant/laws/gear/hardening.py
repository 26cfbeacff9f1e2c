"""Stiffness of the gear that rises with its torque."""

from __future__ import annotations

from kbs_process.plant.effect import Effect, Normal, Port, amplitude


def torque(rotor_angle: float, joint_angle: float, ratio: float, hardening: float) -> float:
    r"""Torque of the gear on the output beyond that of a linear spring.

    Equation: $T = K_3 (\theta_r/R - \theta_l)^3$.
    Units: rad, rad, 1, N m/rad^3 -> N m.
    Validity: a smooth curve in place of the three slopes of a supplier's table.
    Source: H. D. Taghirad, P. R. Belanger, Modeling and parameter identification of harmonic drive systems, J. Dynamic
        Systems, Measurement, and Control 120 (1998) 439.
    """
    windup = rotor_angle / ratio - joint_angle
    return hardening * windup * windup * windup


STIFFNESS_HARDENING = Effect(
    "stiffness_hardening",
    Port.TRANSMISSION,
    torque,
    (amplitude("hardening", "N m/rad^3", Normal(0.0, 3e9), "cubic stiffness", 1e12),),
    family="stiffness",
    order=210,
)
