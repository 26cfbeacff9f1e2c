"""An encoder that is coarser than its declared code."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import LogNormal, Normal, Parameter
from kbs_process.plant.sensing.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(reading: Array, code: float, coarse_share: float, coarse_codes: float) -> Array:
    r"""Change of an angle by rounding it to several codes.

    Equation: $\Delta\theta = s (\theta_m \lfloor \theta/\theta_m + 1/2 \rfloor - \theta)$,
        $\theta_m = m \theta_{code}$.
    Units: rad, rad, 1, 1 -> rad.
    Validity: s = 1 is a coarse encoder; the rounding to its declared code is not in the reading.
    Source: IEEE Std 1241-2010, Terminology and test methods for analog-to-digital converters.
    """
    coarse = coarse_codes * code
    return coarse_share * (np.floor(reading / coarse + 0.5) * coarse - reading)


ENCODER_QUANTISATION = Sensing(
    name="encoder_quantisation",
    port=SensingPort.ENCODER,
    equation=change,
    parameters=(
        Parameter("coarse_share", "1", Normal(0.0, 1.0), "1: all of it", (-10.0, 10.0), role="amplitude"),
        Parameter(
            "coarse_codes",
            "1",
            LogNormal(4.0, 1.0),
            "declared codes in a coarse one",
            (1.0, 1e5),
            grid=(2.0, 4.0, 8.0, 16.0, 32.0),
        ),
    ),
    reference="IEEE Std 1241-2010, Terminology and test methods for analog-to-digital converters",
    whole_band=True,
)
