"""Play of a channel: a joint in its load path that sticks until it slips."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import LogNormal, Normal, Parameter, amplitude
from kbs_process.plant.sensing import Sensing, SensingPort, recursion
from kbs_process.signals.records import Array


@recursion
def stopped(x: Array, displacement: float) -> Array:
    r"""Prandtl's stop z (n,) along x (n,), from z = 0: it follows x until it stands at -1 or 1.

    Equation: $z_k = \max(-1, \min(1, z_{k-1} + (x_k - x_{k-1}) / x_0))$, exact between two samples.
    """
    z = np.zeros_like(x)
    for k in range(1, len(x)):
        z[k] = max(-1.0, min(1.0, z[k - 1] + (x[k] - x[k - 1]) / displacement))
    return z


def change(reading: Array, sticking: float, sticking_travel: float) -> Array:
    r"""Change of a channel by what its load was before, where a part of it sticks, then slips.

    Equation: $\Delta y = -h z$, $dz/dy = 1 / y_0$ while $|z| < 1$, and 0 where $z$ would leave that: a stop, which is a
        gain less a play.
    Units: the channel's, the channel's, the channel's -> the channel's.
    Validity: does not depend on rate; from a virgin state at the recording's start. One joint; many that slip one after
        the other make the rounded loop of `channel_hysteresis`.
    Source: M. Brokate, J. Sprekels, Hysteresis and Phase Transitions (1996), section 2.1: Prandtl's stop and play.
    """
    return -sticking * stopped(reading, sticking_travel)


CHANNEL_PLAY = Sensing(
    "channel_play",
    SensingPort.CHANNEL,
    change,
    (
        amplitude("sticking", "1", Normal(0.0, 0.05), "half the loop's width, in the channel's unit", 1e3),
        Parameter(
            "sticking_travel",
            "1",
            LogNormal(1.0, 1.0),
            "half the change of load that slips, in the channel's unit",
            (1e-9, 1e6),
            grid=(0.005, 0.015, 0.05, 0.15),
            over="reading.span",
        ),
    ),
    whole_band=True,
    family="sensor hysteresis",
    order=80,
)
