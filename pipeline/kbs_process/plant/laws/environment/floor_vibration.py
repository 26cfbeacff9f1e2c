"""Vibration of the laboratory's floor."""

from __future__ import annotations

import math

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port


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


_AMPLITUDE = Normal(0.0, 1e-3)
_BOUNDS = (-1.0, 1.0)

FLOOR_VIBRATION = Effect(
    name="floor_vibration",
    order=430,
    port=Port.BASE_ACCELERATION,
    equation=acceleration,
    parameters=(
        Parameter("floor_x_sin", "m/s^2", _AMPLITUDE, "sine along x", _BOUNDS, role="amplitude"),
        Parameter("floor_x_cos", "m/s^2", _AMPLITUDE, "cosine along x", _BOUNDS, role="amplitude"),
        Parameter("floor_y_sin", "m/s^2", _AMPLITUDE, "sine along y", _BOUNDS, role="amplitude"),
        Parameter("floor_y_cos", "m/s^2", _AMPLITUDE, "cosine along y", _BOUNDS, role="amplitude"),
        Parameter("floor_z_sin", "m/s^2", _AMPLITUDE, "sine along z", _BOUNDS, role="amplitude"),
        Parameter("floor_z_cos", "m/s^2", _AMPLITUDE, "cosine along z", _BOUNDS, role="amplitude"),
        Parameter(
            "floor_frequency",
            "Hz",
            LogNormal(5.0, 1.0),
            "frequency of the tone, at the recording's start",
            (0.01, 500.0),
            over="spectrum",
        ),
        Parameter(
            "floor_sweep", "Hz/s", Normal(0.0, 1e-2), "change of the frequency with time", (-10.0, 10.0), grid=(0.0,)
        ),
    ),
    reference="C. G. Gordon, Generic criteria for vibration-sensitive equipment, Proc. SPIE 1619 (1991) 71",
    each_trial=True,
)
