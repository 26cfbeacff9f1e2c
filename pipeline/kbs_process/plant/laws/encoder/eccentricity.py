"""Eccentricity of an encoder's disc, or of its two heads."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import Normal, Parameter, sine_and_cosine
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(reading: Array, eccentric_sin: float, eccentric_cos: float, eccentric_order: float) -> Array:
    r"""Change of an angle that repeats once or twice a turn.

    Equation: $\Delta\theta = a \sin k \theta + b \cos k \theta$.
    Units: rad, rad, rad, 1 -> rad.
    Validity: once a turn with one reading head, twice with two, by a tilted or oval disc. Over less than a turn
        much of it is an offset and a gain.
    Source: L. M. Sanchez-Brea, T. Morlanes, Metrological errors in optical encoders, Measurement Science and
        Technology 19 (2008) 115104.
    """
    return eccentric_sin * np.sin(eccentric_order * reading) + eccentric_cos * np.cos(eccentric_order * reading)


ENCODER_ECCENTRICITY = Sensing(
    "encoder_eccentricity",
    SensingPort.ENCODER,
    change,
    (
        *sine_and_cosine("eccentric", "rad", Normal(0.0, 2e-4), "of the error", 0.1),
        Parameter(
            "eccentric_order",
            "1",
            Normal(1.0, 1.0),
            "periods in a turn",
            (0.0, 1e5),
            grid=(1.0, 2.0, 4.0),
            proposed="disc order",
            whole=True,
        ),
    ),
    family="eccentricity",
    order=140,
)
