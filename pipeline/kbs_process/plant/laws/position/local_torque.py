"""Torque of a joint at one place: a kinked harness, a damaged bearing."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port


def torque(joint_angle: float, local: float, local_angle: float, local_width: float) -> float:
    r"""Torque on the output, reacted by the body that carries the motor.

    Equation: $T = T_0 \exp(-((\theta_l - \theta_0) / w)^2 / 2)$.
    Units: rad, N m, rad, rad -> N m.
    Validity: the same in both senses of rotation.
    Source: C. M. Bishop, Pattern Recognition and Machine Learning (2006), section 3.1: a Gaussian basis function.
    """
    away = (joint_angle - local_angle) / local_width
    return local * math.exp(-0.5 * away * away)


LOCAL_TORQUE = Effect(
    name="local_torque",
    order=340,
    port=Port.JOINT_TORQUE,
    equation=torque,
    parameters=(
        Parameter("local", "N m", Normal(0.0, 0.5), "greatest torque", (-100.0, 100.0), role="amplitude"),
        Parameter(
            "local_angle",
            "rad",
            Normal(0.0, 3.0),
            "angle of the greatest torque",
            (-100.0, 100.0),
            grid=tuple((i + 0.5) / 12.0 for i in range(12)),
            over="joint_angle",
        ),
        Parameter(
            "local_width",
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
