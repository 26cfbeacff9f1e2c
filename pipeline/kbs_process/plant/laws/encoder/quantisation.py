"""An encoder that is coarser than its declared code."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import LogNormal, Normal, Parameter, amplitude
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(reading: Array, code: float, coarse_share: float, coarse_codes: float) -> Array:
    r"""Change of an angle by rounding it to several codes instead of one.

    Equation: $\Delta\theta = s (r_m(\theta) - r_1(\theta))$,
        $r_m(\theta) = m \theta_{code} \lfloor \theta/(m \theta_{code}) + 1/2 \rfloor$.
    Units: rad, rad, 1, 1 -> rad.
    Validity: s = 1 is a coarse encoder, s below a half none. The rounding to its declared code is not in the reading,
        but with its noise; as the law is without it, an encoder that is as declared has no s above 0, or, where
        motions pass few codes, hardly any.
    Source: IEEE Std 1241-2010, Terminology and test methods for analog-to-digital converters.
    """
    return coarse_share * (_rounded(reading, coarse_codes * code) - _rounded(reading, code))


def _rounded(reading: Array, code: float) -> Array:
    return np.floor(reading / code + 0.5) * code


ENCODER_QUANTISATION = Sensing(
    "encoder_quantisation",
    SensingPort.ENCODER,
    change,
    (
        amplitude("coarse_share", "1", Normal(1.0, 0.5), "1: all of it", (0.5, 2.0)),
        Parameter(
            "coarse_codes",
            "1",
            LogNormal(4.0, 1.0),
            "declared codes in a coarse one",
            (1.5, 1e5),
            grid=(2.0, 4.0, 8.0, 16.0, 32.0),
        ),
    ),
    whole_band=True,
    family="quantisation",
    order=180,
)
