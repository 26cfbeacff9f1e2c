"""An S-shaped characteristic of a channel: its gain about one load is not that on either side."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import LogNormal, Normal, Parameter, amplitude
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(reading: Array, swing: float, swing_load: float, swing_width: float) -> Array:
    r"""Change of a channel of which the gain is higher, or lower, about one load.

    Equation: $\Delta y = s \tanh \frac{y - y_0}{w}$.
    Units: the channel's, the channel's, the channel's, the channel's -> the channel's.
    Validity: one load, about which the gain changes by s / w over 2 w, some hundredths of the range and more. What is
        narrower switches (`channel_step`), and between both recordings do not tell which it is.
    Source: VDI/VDE 2638, Characteristics of force transducers: terms and definitions (2008); as a differential
        amplifier saturates.
    """
    return np.asarray(swing * np.tanh((reading - swing_load) / swing_width))


CHANNEL_S_SHAPE = Sensing(
    "channel_s_shape",
    SensingPort.CHANNEL,
    change,
    (
        amplitude("swing", "1", Normal(0.0, 0.5), "half of the change from far below to far above", 1e3),
        Parameter(
            "swing_load",
            "1",
            Normal(0.0, 1e3),
            "its middle, in the channel's unit",
            (-1e6, 1e6),
            grid=tuple((i + 0.5) / 12.0 for i in range(12)),
            over="reading",
        ),
        Parameter(
            "swing_width",
            "1",
            LogNormal(1.0, 0.5),
            "load over which the gain is otherwise, in the channel's unit",
            (1e-9, 1e6),
            grid=(0.03, 0.1, 0.3),
            over="reading.span",
        ),
    ),
    whole_band=True,
    family="non-linearity",
    order=50,
)
