"""Coulomb friction of a joint's bearings."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port


def torque(joint_rate: float, coulomb: float, coulomb_rate: float) -> float:
    r"""Torque on the output, reacted by the body that carries the motor.

    Equation: $T = -T_c \tanh(\omega_l / \omega_c)$.
    Units: rad/s, N m, rad/s -> N m.
    Validity: rates above $\omega_c$, below which it creeps in place of sticking; `dahl` sticks.
    Source: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and compensation
        methods for the control of machines with friction, Automatica 30 (1994) 1083.
    """
    return -coulomb * math.tanh(joint_rate / coulomb_rate)


COULOMB = Effect(
    name="coulomb",
    order=250,
    port=Port.JOINT_TORQUE,
    equation=torque,
    parameters=(
        Parameter("coulomb", "N m", Normal(0.0, 0.5), "friction torque", (-100.0, 100.0), role="amplitude", dry=True),
        Parameter("coulomb_rate", "rad/s", LogNormal(5e-4, 1.0), "rate of full friction", (1e-5, 1.0)),
    ),
    reference="B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and "
    "compensation methods for the control of machines with friction, Automatica 30 (1994) 1083",
    passive=True,
)
