"""Coulomb friction of a joint's bearings, alike in both senses or not."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, amplitude


def friction(joint_rate: float, coulomb: float, coulomb_rate: float) -> float:
    r"""Torque on the output, reacted by the body that carries the motor.

    Equation: $T = -T_c \tanh(\omega_l / \omega_c)$.
    Units: rad/s, N m, rad/s -> N m.
    Validity: rates above $\omega_c$, below which it creeps in place of sticking; `dahl` sticks.
    Source: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and compensation
        methods for the control of machines with friction, Automatica 30 (1994) 1083.
    """
    return -coulomb * math.tanh(joint_rate / coulomb_rate)


def asymmetric(joint_rate: float, coulomb_ahead: float, coulomb_astern: float, sense_rate: float) -> float:
    r"""Torque on the output, reacted by the body that carries the motor.

    Equation: $T = -T_+ \max(s, 0) - T_- \min(s, 0)$, $s = \tanh(\omega_l / \omega_c)$.
    Units: rad/s, N m, N m, rad/s -> N m.
    Validity: rates above $\omega_c$; a recording that turns one way tells nothing of the other.
    Source: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and compensation
        methods for the control of machines with friction, Automatica 30 (1994) 1083.
    """
    sense = math.tanh(joint_rate / sense_rate)
    return -coulomb_ahead * max(sense, 0.0) - coulomb_astern * min(sense, 0.0)


def full_at(name: str) -> Parameter:
    """Return the rate of a joint from which its friction is full."""
    return Parameter(name, "rad/s", LogNormal(5e-4, 1.0), "rate of full friction", (1e-5, 1.0))


COULOMB = Effect(
    "coulomb",
    Port.JOINT_TORQUE,
    friction,
    (amplitude("coulomb", "N m", Normal(0.0, 0.5), "friction torque", 100.0, dry=True), full_at("coulomb_rate")),
    passive=True,
    family="friction",
    order=250,
)
ASYMMETRIC_COULOMB = Effect(
    "asymmetric_coulomb",
    Port.JOINT_TORQUE,
    asymmetric,
    (
        amplitude("coulomb_ahead", "N m", Normal(0.0, 0.5), "of positive rates", 100.0, dry=True),
        amplitude("coulomb_astern", "N m", Normal(0.0, 0.5), "of negative rates", 100.0, dry=True),
        full_at("sense_rate"),
    ),
    passive=True,
    family="friction",
    order=260,
)
