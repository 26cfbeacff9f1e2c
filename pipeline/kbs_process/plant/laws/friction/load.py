"""Friction of a joint in proportion to the gear's load."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, Normal, Port, amplitude, shared
from kbs_process.plant.laws.friction.coulomb import full_at
from kbs_process.plant.laws.gear.flexspline import FLEXSPLINE


def torque(
    rotor_angle: float,
    joint_angle: float,
    joint_rate: float,
    ratio: float,
    load_share: float,
    load_rate: float,
    Ka: float,
) -> float:
    r"""Torque on the output, reacted by the body that carries the motor.

    Equation: $T = -\mu |K_a (\theta_r/R - \theta_l)| \tanh(\omega_l / \omega_c)$.
    Units: rad, rad, rad/s, 1, 1, rad/s, N m/rad -> N m.
    Validity: dry contact that carries the gear's torque; rates above $\omega_c$.
    Source: A. C. Bittencourt, S. Gunnarsson, Static friction in a robot joint: modeling and identification of load and
        temperature effects, J. Dynamic Systems, Measurement, and Control 134 (2012) 051013.
    """
    load = abs(Ka * (rotor_angle / ratio - joint_angle))
    return -load_share * load * math.tanh(joint_rate / load_rate)


LOAD_FRICTION = Effect(
    "load_friction",
    Port.JOINT_TORQUE,
    torque,
    (
        amplitude("load_share", "1", Normal(0.0, 0.05), "friction over load", 1.0, dry=True),
        full_at("load_rate"),
        shared(FLEXSPLINE, "Ka"),
    ),
    passive=True,
    family="friction",
    order=270,
)
