"""A step of a channel's error where its converter or amplifier switches."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import LogNormal, Normal, Parameter, amplitude
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(reading: Array, jump: float, jump_load: float, jump_width: float) -> Array:
    r"""Change of a channel beyond the load at which its amplifier or converter switches.

    Equation: $\Delta y = \frac{s}{2} \left(1 + \tanh \frac{y - y_0}{w}\right)$.
    Units: the channel's, the channel's, the channel's, the channel's -> the channel's.
    Validity: one place; the same in both senses. The width is what noise and filters before the switch smear it over.
    Source: IEEE Std 1241-2010, Terminology and test methods for analog-to-digital converters, differential
        non-linearity.
    """
    return np.asarray(0.5 * jump * (1.0 + np.tanh((reading - jump_load) / jump_width)))


CHANNEL_STEP = Sensing(
    "channel_step",
    SensingPort.CHANNEL,
    change,
    (
        amplitude("jump", "1", Normal(0.0, 0.5), "of the error, in the channel's unit", 1e3),
        Parameter(
            "jump_load",
            "1",
            Normal(0.0, 1e3),
            "where it switches, in the channel's unit",
            (-1e6, 1e6),
            grid=tuple((i + 0.5) / 24.0 for i in range(24)),
            over="reading",
        ),
        Parameter(
            "jump_width",
            "1",
            LogNormal(1.0, 0.5),
            "load over which it switches, in the channel's unit",
            (1e-9, 1e6),
            grid=(0.004, 0.01),
            over="reading.span",
        ),
    ),
    whole_band=True,
    family="converter",
    order=60,
)
