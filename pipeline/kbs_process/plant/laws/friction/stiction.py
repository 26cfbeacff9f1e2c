"""Stiction of the Harmonic Drive at tooth passing."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Parameter, Port, amplitude, critical, phase

_INSTANT = 1e-6  # rad of tooth phase


def limit(rotor_angle: float, rotor_travel: float, Ts0: float, delta: float, phi_stat: float) -> float:
    r"""Greatest Coulomb friction torque on the rotor, mean over what it turns in a step.

    Equation: $T_s = T_{s0}$ where $|\operatorname{wrap}(200 \theta_r + \phi_{stat})| < \delta$, else 0; wrap to
        (-pi, pi].
        Over a travel, $T_{s0}$ times the share of it within the teeth's contact.
    Units: rad, rad, N m, rad, rad -> N m.
    Validity: 0 <= delta <= pi; the plant holds the rotor exactly, without a regularised sign.
    Source: ENVISAT Ka-band subsystem: Measurement and prediction of the performance of a satellite based antenna
        pointing mechanism and controller, Trans. Built Environment 19 (1996), section 5, static friction.
    """
    angle = 200.0 * rotor_angle + phi_stat
    wrapped = angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)
    half = abs(100.0 * rotor_travel)
    if half < _INSTANT:
        return Ts0 if abs(wrapped) < delta else 0.0
    # Contact passed since phase 0, which grows by 2 delta a turn: the integral of the equation.
    begin, end = wrapped - half, wrapped + half
    turn_0 = math.floor(begin / (2.0 * math.pi) + 0.5)
    turn_1 = math.floor(end / (2.0 * math.pi) + 0.5)
    passed_0 = max(-delta, min(delta, begin - 2.0 * math.pi * turn_0)) + 2.0 * delta * turn_0
    passed_1 = max(-delta, min(delta, end - 2.0 * math.pi * turn_1)) + 2.0 * delta * turn_1
    return Ts0 * max(0.0, passed_1 - passed_0) / (2.0 * half)


TOOTH_STICTION = Effect(
    "tooth_stiction",
    Port.MOTOR_FRICTION,
    limit,
    (
        critical(
            amplitude("Ts0", "N m", LogNormal(6e-3, 0.25), "Coulomb torque while a tooth passes", (0.0, 1.0), dry=True)
        ),
        critical(
            Parameter(
                "delta",
                "rad",
                LogNormal(0.5, 0.2),
                "half width of tooth contact",
                (0.0, math.pi),
                grid=(0.25, 0.5, 1.0),
            )
        ),
        critical(phase("phi_stat", "its phase")),
    ),
    passive=True,
    family="stiction",
    periods=200.0,
    order=50,
)
