"""Eccentricity of an encoder's disc, or of its two heads."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import Normal, Parameter
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
    name="encoder_eccentricity",
    order=140,
    port=SensingPort.ENCODER,
    equation=change,
    parameters=(
        Parameter("eccentric_sin", "rad", Normal(0.0, 2e-4), "sine of the error", (-0.1, 0.1), role="amplitude"),
        Parameter("eccentric_cos", "rad", Normal(0.0, 2e-4), "cosine of the error", (-0.1, 0.1), role="amplitude"),
        Parameter("eccentric_order", "1", Normal(1.0, 1.0), "periods in a turn", (0.0, 1e5), grid=(1.0, 2.0, 4.0)),
    ),
    reference="L. M. Sanchez-Brea, T. Morlanes, Metrological errors in optical encoders, Measurement Science and "
    "Technology 19 (2008) 115104",
)
