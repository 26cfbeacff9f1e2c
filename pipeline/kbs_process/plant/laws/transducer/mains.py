"""Pick-up of the mains, or another steady tone, in a channel."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import LogNormal, Normal, Parameter, sine_and_cosine
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(time: Array, mains_sin: float, mains_cos: float, mains_frequency: float) -> Array:
    r"""Change of a channel by a tone that is no load.

    Equation: $\Delta y = a \sin(2 \pi f t) + b \cos(2 \pi f t)$.
    Units: s, the channel's, the channel's, Hz -> the channel's.
    Validity: f is where sampling has put the tone: 50.1 Hz at 50 Hz shows at 0.1 Hz. Its phase is a recording's own.
    Source: H. W. Ott, Electromagnetic Compatibility Engineering (2009), chapter 2.
    """
    phase = 2.0 * np.pi * mains_frequency * time
    return mains_sin * np.sin(phase) + mains_cos * np.cos(phase)


MAINS = Sensing(
    "mains",
    SensingPort.CHANNEL,
    change,
    (
        *sine_and_cosine("mains", "1", Normal(0.0, 0.05), "in the channel's unit", 1e3),
        Parameter(
            "mains_frequency",
            "Hz",
            LogNormal(1.0, 2.0),
            "of the tone in the band",
            (1e-3, 1e4),
            over="spectrum",
            proposed="tone",
        ),
    ),
    each_trial=True,
    family="mains",
    order=130,
)
