"""Dry friction of the motor or the wave generator, which falls as its lubricant begins to carry."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port


def torque(rotor_rate: float, sliding: float, breakaway: float, breakaway_rate: float, breakaway_start: float) -> float:
    r"""Torque on the rotor beyond that of `dynamic_friction`, which begins at one rate of its own.

    Equation: $T = -(T_c + T_s e^{-(\omega_r/\omega_s)^2}) \tanh(\omega_r / \omega_0)$.
    Units: rad/s, N m, N m, rad/s, rad/s -> N m.
    Validity: rates above $\omega_0$; without the delay of a lubricant's film.
    Source: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and compensation
        methods for the control of machines with friction, Automatica 30 (1994) 1083.
    """
    share = rotor_rate / breakaway_rate
    level = sliding + breakaway * math.exp(-share * share)
    return -level * math.tanh(rotor_rate / breakaway_start)


MOTOR_STRIBECK = Effect(
    name="motor_stribeck",
    order=150,
    port=Port.MOTOR_TORQUE,
    equation=torque,
    parameters=(
        Parameter("sliding", "N m", Normal(0.0, 0.01), "excess at speed", (-1.0, 1.0), role="amplitude", dry=True),
        Parameter(
            "breakaway", "N m", Normal(0.0, 0.01), "excess at breakaway", (-1.0, 1.0), role="amplitude", dry=True
        ),
        Parameter(
            "breakaway_rate",
            "rad/s",
            LogNormal(0.3, 1.0),
            "rate at which the excess has fallen to 1/e",
            (1e-3, 1e3),
            grid=(0.05, 0.15, 0.5, 1.5),
        ),
        Parameter(
            "breakaway_start", "rad/s", LogNormal(0.02, 1.0), "rate of full friction", (1e-4, 10.0), grid=(0.02, 0.1)
        ),
    ),
    reference="B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and "
    "compensation methods for the control of machines with friction, Automatica 30 (1994) 1083",
    passive=True,
)
