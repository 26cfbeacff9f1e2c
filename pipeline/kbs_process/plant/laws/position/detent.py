"""Torque of a joint about one angle to or from which it is drawn: a ball that rolls over a dent, a latch."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port


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
    name="detent",
    order=350,
    port=Port.JOINT_TORQUE,
    equation=torque,
    parameters=(
        Parameter("detent", "N m", Normal(0.0, 0.5), "greatest torque", (-100.0, 100.0), role="amplitude"),
        Parameter(
            "detent_angle",
            "rad",
            Normal(0.0, 3.0),
            "angle without torque, in its middle",
            (-100.0, 100.0),
            grid=tuple((i + 0.5) / 12.0 for i in range(12)),
            over="joint_angle",
        ),
        Parameter(
            "detent_width",
            "rad",
            LogNormal(0.03, 1.0),
            "from its middle to the greatest torque",
            (1e-4, 3.0),
            grid=(0.03, 0.08),
            over="joint_angle.span",
        ),
    ),
    reference="H. Goldstein, Classical Mechanics (1980), section 1.1: torque as the slope of a potential",
)
