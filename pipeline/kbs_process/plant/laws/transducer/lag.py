"""Lag or creep of a channel."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import LogNormal, Normal, Parameter, amplitude
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(reading: Array, time: Array, lag_share: float, lag_time: float) -> Array:
    r"""Change of a channel of which a share follows its load late.

    Equation: $\Delta y = g (x - y)$, $\tau \dot x = y - x$, from rest.
    Units: the channel's, s, 1, s -> the channel's.
    Validity: g = 1 is a lag of first order, a small g the creep of a gauge's glue. Readings are linear between samples.
    Source: VDI/VDE 2638, Characteristics of force transducers: terms and definitions (2008), creep and zero drift.
    """
    from scipy.signal import lfilter  # takes longer to import than all laws

    step = float(time[1] - time[0])
    left = float(np.exp(-step / lag_time))
    # Exact for a reading that is linear between samples: the late share is the reading less the filtered slope.
    slope = np.diff(reading, prepend=reading[0]) / step
    late = lfilter([lag_time * (1.0 - left)], [1.0, -left], slope)
    return -lag_share * late


CHANNEL_LAG = Sensing(
    "channel_lag",
    SensingPort.CHANNEL,
    change,
    (
        amplitude("lag_share", "1", Normal(0.0, 0.5), "share that follows late", 10.0),
        Parameter(
            "lag_time", "s", LogNormal(0.1, 1.5), "time constant", (1e-4, 1e5), grid=(0.02, 0.1, 0.5, 2.0, 10.0, 50.0)
        ),
    ),
    family="lag",
    order=90,
)
