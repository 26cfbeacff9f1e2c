"""A bit of an encoder's converter that switches at a wrong level."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import Normal, Parameter, amplitude
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(reading: Array, code: float, switching: float, switching_bit: float) -> Array:
    r"""Change of an angle by a bit whose weight is wrong.

    Equation: $\Delta\theta = s\, \operatorname{sign} \sin(2 \pi \theta / (2^n \theta_{code}))$,
        a square wave with the code.
    Units: rad, rad, rad, 1 -> rad.
    Validity: seen as fast as the angle is sampled; a bit that toggles faster averages out.
    Source: IEEE Std 1241-2010, Terminology and test methods for analog-to-digital converters.
    """
    square: Array = np.sign(np.sin(2.0 * np.pi * reading / (code * 2.0**switching_bit)))
    return switching * square


ENCODER_SWITCHING = Sensing(
    "encoder_switching",
    SensingPort.ENCODER,
    change,
    (
        amplitude("switching", "rad", Normal(0.0, 2e-4), "half the error of the bit's weight", 0.1),
        Parameter(
            "switching_bit",
            "1",
            Normal(6.0, 3.0),
            "codes in a period, as a power of 2",
            (1.0, 32.0),
            grid=tuple(float(n) for n in range(2, 15)),
            whole=True,
        ),
    ),
    whole_band=True,
    family="converter",
    order=160,
)
