"""Drift of a channel that dies out."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import LogNormal, Normal, Parameter
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array

SLOWER = 4.0  # times: what warms up or creeps has a spectrum of times, of which two follow most


def change(time: Array, creep: float, creep_slow: float, creep_time: float) -> Array:
    r"""Change of a channel after its amplifier was switched on, or its load changed.

    Equation: $\Delta y = c e^{-t/\tau} + c_s e^{-t/(4 \tau)}$.
    Units: s, the channel's, the channel's, s -> the channel's.
    Validity: from the recording's time zero on. Relaxation has many times; the second term stands for the slower ones.
    Source: VDI/VDE 2638, Characteristics of force transducers: terms and definitions (2008), creep and zero drift;
        W. N. Findley, J. S. Lai, K. Onaran, Creep and Relaxation of Nonlinear Viscoelastic Materials (1976), chapter 5.
    """
    return creep * np.exp(-time / creep_time) + creep_slow * np.exp(-time / (SLOWER * creep_time))


DRIFT_EXPONENTIAL = Sensing(
    name="drift_exponential",
    order=110,
    port=SensingPort.CHANNEL,
    equation=change,
    parameters=(
        Parameter("creep", "1", Normal(0.0, 1.0), "at time zero, in the channel's unit", (-1e4, 1e4), role="amplitude"),
        Parameter(
            "creep_slow",
            "1",
            Normal(0.0, 1.0),
            "of what dies out more slowly, in the channel's unit",
            (-1e4, 1e4),
            role="amplitude",
        ),
        Parameter("creep_time", "s", LogNormal(60.0, 1.0), "time constant", (0.1, 1e6), grid=(5.0, 15.0, 50.0, 150.0)),
    ),
    reference="VDI/VDE 2638, Characteristics of force transducers (2008)",
    each_trial=True,
)
