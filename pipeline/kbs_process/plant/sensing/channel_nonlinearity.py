"""Non-linearity of a channel."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import LogNormal, Normal, Parameter
from kbs_process.plant.sensing.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(reading: Array, bend: float, power: float, bend_scale: float) -> Array:
    r"""Change of a channel by a power of its reading, odd about zero.

    Equation: $\Delta y = c y |y / y_0|^{n-1}$.
    Units: the channel's, 1, 1, the channel's -> the channel's.
    Validity: of the loads that are predicted: what was tared before is not in them.
    Source: VDI/VDE 2638, Characteristics of force transducers: terms and definitions (2008).
    """
    return bend * reading * np.abs(reading / bend_scale) ** (power - 1.0)


CHANNEL_NONLINEARITY = Sensing(
    name="channel_nonlinearity",
    port=SensingPort.CHANNEL,
    equation=change,
    parameters=(
        Parameter(
            "bend",
            "1",
            Normal(0.0, 0.01),
            "share of the reading at the scale",
            (-10.0, 10.0),
            role="amplitude",
        ),
        Parameter("power", "1", Normal(3.0, 1.0), "its power", (1.0, 12.0), grid=(2.0, 3.0, 5.0)),
        Parameter(
            "bend_scale",
            "1",
            LogNormal(10.0, 1.0),
            "reading at which `bend` is meant, in the channel's unit",
            (1e-6, 1e6),
        ),
    ),
    reference="VDI/VDE 2638, Characteristics of force transducers (2008)",
)
