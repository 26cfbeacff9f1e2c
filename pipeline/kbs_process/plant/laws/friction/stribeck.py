"""Friction that falls as a lubricant begins to carry: of a joint, of the motor or the wave generator."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, amplitude, wired


def friction(rate: float, level: float, excess: float, falling_rate: float, start: float) -> float:
    r"""Torque on the output, reacted by the body that carries the motor, or on the rotor.

    On the rotor it is beyond that of `dynamic_friction`, which begins at one rate of its own.

    Equation: $T = -(T_c + T_s e^{-(\omega/\omega_s)^2}) \tanh(\omega / \omega_0)$.
    Units: rad/s, N m, N m, rad/s, rad/s -> N m.
    Validity: rates above $\omega_0$; without the delay of a lubricant's film. The viscous part is `joint_viscous`, or
        `motor_viscous`.
    Source: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and compensation
        methods for the control of machines with friction, Automatica 30 (1994) 1083.
    """
    share = rate / falling_rate
    carried = level + excess * math.exp(-share * share)
    return -carried * math.tanh(rate / start)


_FALLEN, _FULL = "rate at which the excess has fallen to 1/e", "rate of full friction"

STRIBECK = Effect(
    "stribeck",
    Port.JOINT_TORQUE,
    friction,
    (
        amplitude("stribeck_level", "N m", Normal(0.0, 0.5), "Coulomb torque", 100.0, dry=True),
        amplitude("stribeck_excess", "N m", Normal(0.0, 0.5), "excess at breakaway", 100.0, dry=True),
        Parameter(
            "stribeck_rate", "rad/s", LogNormal(3e-3, 1.0), _FALLEN, (1e-5, 10.0), grid=(5e-4, 1.5e-3, 5e-3, 1.5e-2)
        ),
        Parameter("stribeck_start", "rad/s", LogNormal(2e-4, 1.0), _FULL, (1e-5, 1.0)),
    ),
    wires=wired(
        rate="joint_rate",
        level="stribeck_level",
        excess="stribeck_excess",
        falling_rate="stribeck_rate",
        start="stribeck_start",
    ),
    passive=True,
    family="friction",
    order=280,
)
MOTOR_STRIBECK = Effect(
    "motor_stribeck",
    Port.MOTOR_TORQUE,
    friction,
    (
        amplitude("sliding", "N m", Normal(0.0, 0.01), "excess at speed", 1.0, dry=True),
        amplitude("breakaway", "N m", Normal(0.0, 0.01), "excess at breakaway", 1.0, dry=True),
        Parameter("breakaway_rate", "rad/s", LogNormal(0.3, 1.0), _FALLEN, (1e-3, 1e3), grid=(0.05, 0.15, 0.5, 1.5)),
        Parameter("breakaway_start", "rad/s", LogNormal(0.02, 1.0), _FULL, (1e-4, 10.0), grid=(0.02, 0.1)),
    ),
    wires=wired(
        rate="rotor_rate", level="sliding", excess="breakaway", falling_rate="breakaway_rate", start="breakaway_start"
    ),
    passive=True,
    family="friction",
    order=150,
)
