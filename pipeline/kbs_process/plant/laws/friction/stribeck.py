"""Friction of a joint that falls as its lubricant begins to carry."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port


def torque(
    joint_rate: float, stribeck_level: float, stribeck_excess: float, stribeck_rate: float, stribeck_start: float
) -> float:
    r"""Torque on the output, reacted by the body that carries the motor.

    Equation: $T = -(T_c + T_s e^{-(\omega_l/\omega_s)^2}) \tanh(\omega_l / \omega_c)$.
    Units: rad/s, N m, N m, rad/s, rad/s -> N m.
    Validity: rates above $\omega_c$; without the delay of a lubricant's film. The viscous part is `joint_viscous`.
    Source: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and compensation
        methods for the control of machines with friction, Automatica 30 (1994) 1083.
    """
    share = joint_rate / stribeck_rate
    level = stribeck_level + stribeck_excess * math.exp(-share * share)
    return -level * math.tanh(joint_rate / stribeck_start)


STRIBECK = Effect(
    name="stribeck",
    order=280,
    port=Port.JOINT_TORQUE,
    equation=torque,
    parameters=(
        Parameter(
            "stribeck_level", "N m", Normal(0.0, 0.5), "Coulomb torque", (-100.0, 100.0), role="amplitude", dry=True
        ),
        Parameter(
            "stribeck_excess",
            "N m",
            Normal(0.0, 0.5),
            "excess at breakaway",
            (-100.0, 100.0),
            role="amplitude",
            dry=True,
        ),
        Parameter(
            "stribeck_rate",
            "rad/s",
            LogNormal(3e-3, 1.0),
            "rate at which the excess has fallen to 1/e",
            (1e-5, 10.0),
            grid=(5e-4, 1.5e-3, 5e-3, 1.5e-2),
        ),
        Parameter("stribeck_start", "rad/s", LogNormal(2e-4, 1.0), "rate of full friction", (1e-5, 1.0)),
    ),
    reference="B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and "
    "compensation methods for the control of machines with friction, Automatica 30 (1994) 1083",
    passive=True,
)
