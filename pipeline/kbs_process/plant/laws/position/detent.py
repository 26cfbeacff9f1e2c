"""Torque of a joint about one angle to or from which it is drawn: a ball that rolls over a dent, a latch."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, Normal, Port, amplitude
from kbs_process.plant.laws.position.place import place, width


def torque(joint_angle: float, detent: float, detent_angle: float, detent_width: float) -> float:
    r"""Torque on the output, reacted by the body that carries the motor; a pass takes no work.

    Equation: $T = -T_0 u \exp((1 - u^2) / 2)$, $u = (\theta_l - \theta_0) / w$; its potential is
        $-T_0 w \exp((1 - u^2) / 2)$.
    Units: rad, N m, rad, rad -> N m.
    Validity: the same in both senses of rotation; a positive $T_0$ holds the joint there, a negative one is a bump.
    Source: H. Goldstein, Classical Mechanics (1980), section 1.1: torque as the slope of a potential.
    """
    away = (joint_angle - detent_angle) / detent_width
    return -detent * away * math.exp(0.5 - 0.5 * away * away)


DETENT = Effect(
    "detent",
    Port.JOINT_TORQUE,
    torque,
    (
        amplitude("detent", "N m", Normal(0.0, 0.5), "greatest torque", 100.0),
        place("detent_angle", "angle without torque, in its middle", 12),
        width("detent_width", "from its middle to the greatest torque", 0.03, (0.03, 0.08)),
    ),
    family="local torque",
    order=350,
)
