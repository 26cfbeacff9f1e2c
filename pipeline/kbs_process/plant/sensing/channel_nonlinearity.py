"""Non-linearity of a channel."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import LogNormal, Normal, Parameter
from kbs_process.plant.sensing.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(
    reading: Array,
    bend_slope: float,
    bend_even: float,
    bend_odd: float,
    bend_power: float,
    bend_middle: float,
    bend_range: float,
) -> Array:
    r"""Change of a channel by a curved characteristic over the range that it has seen.

    Equation: with $u = (y - y_m) / y_0$, $\Delta y = a_1 u + a_2 u^2 + a_n u |u|^{n-1}$.
    Units: the channel's, the channel's (three), 1, the channel's, the channel's -> the channel's.
    Validity: of the loads that are predicted: what was tared before is not in them. A power about another reading than
        the middle is in the span of the three where n = 3.
    Source: VDI/VDE 2638, Characteristics of force transducers: terms and definitions (2008).
    """
    u = (reading - bend_middle) / bend_range
    odd: Array = u * np.abs(u) ** (bend_power - 1.0)
    return bend_slope * u + bend_even * u**2 + bend_odd * odd


CHANNEL_NONLINEARITY = Sensing(
    name="channel_nonlinearity",
    port=SensingPort.CHANNEL,
    equation=change,
    parameters=(
        Parameter("bend_slope", "1", Normal(0.0, 0.5), "at the range's end", (-1e3, 1e3), role="amplitude"),
        Parameter("bend_even", "1", Normal(0.0, 0.5), "at the range's end", (-1e3, 1e3), role="amplitude"),
        Parameter("bend_odd", "1", Normal(0.0, 0.5), "at the range's end", (-1e3, 1e3), role="amplitude"),
        Parameter("bend_power", "1", Normal(3.0, 1.0), "power of the odd part", (1.5, 12.0), grid=(3.0, 5.0)),
        Parameter(
            "bend_middle",
            "1",
            Normal(0.0, 1e3),
            "middle of the range",
            (-1e6, 1e6),
            grid=(0.5,),
            over="reading",
        ),
        Parameter(
            "bend_range",
            "1",
            LogNormal(10.0, 2.0),
            "half of it",
            (1e-9, 1e6),
            grid=(0.5,),
            over="reading.span",
        ),
    ),
    reference="VDI/VDE 2638, Characteristics of force transducers (2008)",
)
