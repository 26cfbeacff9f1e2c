"""Non-linearity of a channel."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import LogNormal, Normal, Parameter, amplitude
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array

_ORDERS = 6


def change(
    reading: Array,
    bend_1: float,
    bend_2: float,
    bend_3: float,
    bend_4: float,
    bend_5: float,
    bend_6: float,
    bend_middle: float,
    bend_range: float,
) -> Array:
    r"""Change of a channel by a curved characteristic over the range that it has seen.

    Equation: with $u = (y - y_m) / y_0$, $\Delta y = \sum_{n=1}^{6} a_n T_n(u)$, $T_n$ Chebyshev's polynomials.
    Units: the channel's, the channel's (six), the channel's (two) -> the channel's.
    Validity: of the loads that are predicted: what was tared before is not in them. Beyond the range, |u| > 1, the
        change is held: a polynomial says nothing of what it has not seen.
    Source: VDI/VDE 2638, Characteristics of force transducers: terms and definitions (2008).
    """
    u = np.clip((reading - bend_middle) / bend_range, -1.0, 1.0)
    series = np.polynomial.chebyshev.chebval(u, [0.0, bend_1, bend_2, bend_3, bend_4, bend_5, bend_6])
    return np.asarray(series, dtype=np.float64)


CHANNEL_NONLINEARITY = Sensing(
    "channel_nonlinearity",
    SensingPort.CHANNEL,
    change,
    (
        *(amplitude(f"bend_{n}", "1", Normal(0.0, 0.5), f"of T_{n}", 1e3) for n in range(1, _ORDERS + 1)),
        Parameter(
            "bend_middle", "1", Normal(0.0, 1e3), "middle of the range", (-1e6, 1e6), grid=(0.5,), over="reading"
        ),
        Parameter("bend_range", "1", LogNormal(10.0, 2.0), "half of it", (1e-9, 1e6), grid=(0.5,), over="reading.span"),
    ),
    whole_band=True,
    family="non-linearity",
    order=40,
)
