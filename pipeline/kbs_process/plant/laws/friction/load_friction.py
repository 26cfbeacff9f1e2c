"""Friction of a joint in proportion to the gear's load."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, shared
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
    name="load_friction",
    order=270,
    port=Port.JOINT_TORQUE,
    equation=torque,
    parameters=(
        Parameter("load_share", "1", Normal(0.0, 0.05), "friction over load", (-1.0, 1.0), role="amplitude", dry=True),
        Parameter("load_rate", "rad/s", LogNormal(5e-4, 1.0), "rate of full friction", (1e-5, 1.0)),
        shared(FLEXSPLINE, "Ka"),
    ),
    reference="A. C. Bittencourt, S. Gunnarsson, Static friction in a robot joint, J. Dynamic Systems, Measurement, "
    "and Control 134 (2012) 051013",
    passive=True,
)
