"""Stiction of the Harmonic Drive at tooth passing."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Parameter, Port, Uniform


def limit(rotor_angle: float, Ts0: float, delta: float, phi_stat: float) -> float:
    r"""Greatest Coulomb friction torque on the rotor.

    Equation: $T_s = T_{s0}$ where $|wrap(200 \theta_r + \phi_{stat})| < \delta$, else 0; wrap to (-pi, pi].
    Units: rad, N m, rad, rad -> N m.
    Validity: 0 <= delta <= pi; the plant holds the rotor exactly, without a regularised sign.
    Source: ENVISAT Ka-band subsystem (1996), section 5, static friction.
    """
    phase = 200.0 * rotor_angle + phi_stat
    wrapped = phase - 2.0 * math.pi * math.floor(phase / (2.0 * math.pi) + 0.5)
    return Ts0 if abs(wrapped) < delta else 0.0


TOOTH_STICTION = Effect(
    name="tooth_stiction",
    port=Port.MOTOR_FRICTION,
    equation=limit,
    parameters=(
        Parameter(
            "Ts0", "N m", LogNormal(6e-3, 0.25), "Coulomb torque while a tooth passes", bounds=(0.0, 1.0)
        ),
        Parameter("delta", "rad", LogNormal(0.5, 0.2), "half width of tooth contact", bounds=(0.0, math.pi)),
        Parameter("phi_stat", "rad", Uniform(-math.pi, math.pi), "its phase", bounds=(-math.pi, math.pi)),
    ),
    reference="Measurement and prediction of the performance of a satellite based antenna pointing mechanism "
    "and controller, Trans. Built Environment 19 (1996), section 5",
    passive=True,
)
