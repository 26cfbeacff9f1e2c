"""Vibration of the laboratory's floor."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, sine_and_cosine


def acceleration(
    time: float,
    floor_x_sin: float,
    floor_x_cos: float,
    floor_y_sin: float,
    floor_y_cos: float,
    floor_z_sin: float,
    floor_z_cos: float,
    floor_frequency: float,
    floor_sweep: float,
) -> tuple[float, float, float]:
    r"""Acceleration of the floor, along the undeflected T's axes.

    Equation: $a_i = s_i \sin\phi + c_i \cos\phi$ for i = x, y, z, $\phi = 2 \pi f t + \pi k t^2$.
    Units: s, m/s^2 each, Hz, Hz/s -> m/s^2.
    Validity: one tone, steady or of a machine that runs up or down evenly; its phase differs from recording to
        recording.
    Source: C. G. Gordon, Generic criteria for vibration-sensitive equipment, Proc. SPIE 1619 (1991) 71.
    """
    phase = math.pi * (2.0 * floor_frequency + floor_sweep * time) * time
    sine, cosine = math.sin(phase), math.cos(phase)
    return (
        floor_x_sin * sine + floor_x_cos * cosine,
        floor_y_sin * sine + floor_y_cos * cosine,
        floor_z_sin * sine + floor_z_cos * cosine,
    )


FLOOR_VIBRATION = Effect(
    "floor_vibration",
    Port.BASE_ACCELERATION,
    acceleration,
    (
        *sine_and_cosine("floor_x", "m/s^2", Normal(0.0, 1e-3), "along x", 1.0),
        *sine_and_cosine("floor_y", "m/s^2", Normal(0.0, 1e-3), "along y", 1.0),
        *sine_and_cosine("floor_z", "m/s^2", Normal(0.0, 1e-3), "along z", 1.0),
        Parameter(
            "floor_frequency",
            "Hz",
            LogNormal(5.0, 1.0),
            "frequency of the tone, at the recording's start",
            (0.01, 500.0),
            over="spectrum",
            proposed="swept tone",
        ),
        Parameter(
            "floor_sweep",
            "Hz/s",
            Normal(0.0, 1e-2),
            "change of the frequency with time",
            (-10.0, 10.0),
            grid=(0.0,),
            proposed="sweep",
        ),
    ),
    each_trial=True,
    family="vibration",
    order=430,
)
