"""A floor that settles: the laboratory inclines while a recording runs."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, amplitude

GRAVITY = 9.80665  # m/s^2


def acceleration(time: float, tilt_x: float, tilt_y: float, tilt_time: float) -> tuple[float, float, float]:
    r"""Acceleration of a level floor that does what the inclination does, along the undeflected T's axes.

    Equation: $a_i = -g \phi_i (1 - \exp(-t / \tau))$ for i = x, y.
    Units: s, rad each, s -> m/s^2.
    Validity: inclinations much less than one, so slow that the floor's own rotation presses on nothing; towards +x
        and +y they let weight pull that way. Each recording settles by an amount of its own.
    Source: A. Einstein, Jahrbuch der Radioaktivitaet und Elektronik 4 (1907) 411, section 17: weight and acceleration.
    """
    settled = -GRAVITY * (1.0 - math.exp(-max(time, 0.0) / tilt_time))
    return tilt_x * settled, tilt_y * settled, 0.0


FLOOR_TILT = Effect(
    "floor_tilt",
    Port.BASE_ACCELERATION,
    acceleration,
    (
        amplitude("tilt_x", "rad", Normal(0.0, 1e-4), "inclination towards x at last", 0.1),
        amplitude("tilt_y", "rad", Normal(0.0, 1e-4), "towards y", 0.1),
        Parameter(
            "tilt_time",
            "s",
            LogNormal(20.0, 1.0),
            "in which it settles",
            (0.1, 1e6),
            grid=(5.0, 10.0, 20.0, 50.0, 150.0),
        ),
    ),
    each_trial=True,
    family="tilt",
    order=440,
)
