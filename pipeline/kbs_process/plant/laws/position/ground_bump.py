"""Torque of the laboratory on a joint at one place: something that the mechanism touches."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port


def torque(joint_angle: float, touch: float, touch_angle: float, touch_width: float) -> float:
    r"""Torque on the output, reacted by the laboratory.

    Equation: $T = T_0 \exp(-((\theta_l - \theta_0) / w)^2 / 2)$.
    Units: rad, N m, rad, rad -> N m.
    Validity: the same in both senses of rotation.
    Source: C. M. Bishop, Pattern Recognition and Machine Learning (2006), section 3.1: a Gaussian basis function.
    """
    away = (joint_angle - touch_angle) / touch_width
    return touch * math.exp(-0.5 * away * away)


GROUND_BUMP = Effect(
    name="ground_bump",
    order=370,
    port=Port.GROUND_TORQUE,
    equation=torque,
    parameters=(
        Parameter("touch", "N m", Normal(0.0, 0.5), "greatest torque", (-100.0, 100.0), role="amplitude"),
        Parameter(
            "touch_angle",
            "rad",
            Normal(0.0, 3.0),
            "angle of the greatest torque",
            (-100.0, 100.0),
            grid=tuple((i + 0.5) / 12.0 for i in range(12)),
            over="joint_angle",
        ),
        Parameter(
            "touch_width",
            "rad",
            LogNormal(0.03, 1.0),
            "its standard width",
            (1e-4, 3.0),
            grid=(0.03, 0.08),
            over="joint_angle.span",
        ),
    ),
    reference="C. M. Bishop, Pattern Recognition and Machine Learning (2006), section 3.1",
)
