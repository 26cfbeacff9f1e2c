"""Interpolation error of an encoder: its sine and cosine are not equal, not centred, or not in quadrature."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import Normal, Parameter, sine_and_cosine
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(
    reading: Array, code: float, interpolation_sin: float, interpolation_cos: float, interpolation_bits: float
) -> Array:
    r"""Change of an angle that repeats with every period of the grating.

    Equation: $\Delta\theta = a \sin \varphi + b \cos \varphi$, $\varphi = 2 \pi \theta / (2^n \theta_{code})$.
    Units: rad, rad, rad, rad, 1 -> rad.
    Validity: one harmonic: once a period for an offset of sine or cosine, twice for unequal ones. Seen as fast as the
        angle is sampled.
    Source: L. M. Sanchez-Brea, T. Morlanes, Metrological errors in optical encoders, Measurement Science and
        Technology 19 (2008) 115104.
    """
    phase: Array = 2.0 * np.pi * reading / (code * 2.0**interpolation_bits)
    return interpolation_sin * np.sin(phase) + interpolation_cos * np.cos(phase)


ENCODER_INTERPOLATION = Sensing(
    "encoder_interpolation",
    SensingPort.ENCODER,
    change,
    (
        *sine_and_cosine("interpolation", "rad", Normal(0.0, 2e-4), "of the error", 0.1),
        Parameter(
            "interpolation_bits",
            "1",
            Normal(6.0, 3.0),
            "codes in a period, as a power of 2",
            (1.0, 32.0),
            grid=tuple(float(n) for n in range(2, 13)),
            proposed="disc bits",
            whole=True,
        ),
    ),
    whole_band=True,
    family="converter",
    order=150,
)
