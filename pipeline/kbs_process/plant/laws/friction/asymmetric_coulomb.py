"""Coulomb friction of a joint that differs with the sense of rotation."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port


def torque(joint_rate: float, coulomb_ahead: float, coulomb_astern: float, sense_rate: float) -> float:
    r"""Torque on the output, reacted by the body that carries the motor.

    Equation: $T = -T_+ \max(s, 0) - T_- \min(s, 0)$, $s = \tanh(\omega_l / \omega_c)$.
    Units: rad/s, N m, N m, rad/s -> N m.
    Validity: rates above $\omega_c$; a recording that turns one way tells nothing of the other.
    Source: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and compensation
        methods for the control of machines with friction, Automatica 30 (1994) 1083.
    """
    sense = math.tanh(joint_rate / sense_rate)
    return -coulomb_ahead * max(sense, 0.0) - coulomb_astern * min(sense, 0.0)


ASYMMETRIC_COULOMB = Effect(
    name="asymmetric_coulomb",
    order=260,
    port=Port.JOINT_TORQUE,
    equation=torque,
    parameters=(
        Parameter(
            "coulomb_ahead", "N m", Normal(0.0, 0.5), "of positive rates", (-100.0, 100.0), role="amplitude", dry=True
        ),
        Parameter(
            "coulomb_astern", "N m", Normal(0.0, 0.5), "of negative rates", (-100.0, 100.0), role="amplitude", dry=True
        ),
        Parameter("sense_rate", "rad/s", LogNormal(5e-4, 1.0), "rate of full friction", (1e-5, 1.0)),
    ),
    reference="B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and "
    "compensation methods for the control of machines with friction, Automatica 30 (1994) 1083",
    passive=True,
)
