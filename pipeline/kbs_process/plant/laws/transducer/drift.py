"""Drift of a channel: with time, after it was switched on, with temperature."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import LogNormal, Normal, Parameter, amplitude
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array

SLOWER = 4.0  # times: what warms up or creeps has a spectrum of times, of which two follow most


def linear(time: Array, drift: float) -> Array:
    r"""Change of a channel with time.

    Equation: $\Delta y = d t$.
    Units: s, a second of the channel's unit -> the channel's.
    Validity: where no slope of each recording is removed before.
    Source: VDI/VDE 2638, Characteristics of force transducers: terms and definitions (2008), creep and zero drift.
    """
    return drift * time


def exponential(time: Array, creep: float, creep_slow: float, creep_time: float) -> Array:
    r"""Change of a channel after its amplifier was switched on, or its load changed.

    Equation: $\Delta y = c e^{-t/\tau} + c_s e^{-t/(4 \tau)}$.
    Units: s, the channel's, the channel's, s -> the channel's.
    Validity: from the recording's time zero on. Relaxation has many times; the second term stands for the slower ones.
    Source: VDI/VDE 2638, Characteristics of force transducers: terms and definitions (2008), creep and zero drift;
        W. N. Findley, J. S. Lai, K. Onaran, Creep and Relaxation of Nonlinear Viscoelastic Materials (1976), chapter 5.
    """
    return creep * np.exp(-time / creep_time) + creep_slow * np.exp(-time / (SLOWER * creep_time))


def thermal_drift(temperature: Array, thermal: float) -> Array:
    r"""Change of a channel's zero with its temperature.

    Equation: $\Delta y = k (T - T(0))$.
    Units: degC, the channel's for 1 degC -> the channel's.
    Validity: bridge and article at one temperature; needs its recording.
    Source: VDI/VDE 2638, Characteristics of force transducers: terms and definitions (2008), creep and zero drift.
    """
    warmer: Array = temperature - temperature[0]
    return thermal * warmer


DRIFT_LINEAR = Sensing(
    "drift_linear",
    SensingPort.CHANNEL,
    linear,
    (amplitude("drift", "1/s", Normal(0.0, 1e-3), "in the channel's unit", 10.0),),
    each_trial=True,
    family="drift",
    order=100,
)
DRIFT_EXPONENTIAL = Sensing(
    "drift_exponential",
    SensingPort.CHANNEL,
    exponential,
    (
        amplitude("creep", "1", Normal(0.0, 1.0), "at time zero, in the channel's unit", 1e4),
        amplitude("creep_slow", "1", Normal(0.0, 1.0), "of what dies out more slowly, in the channel's unit", 1e4),
        Parameter("creep_time", "s", LogNormal(60.0, 1.0), "time constant", (0.1, 1e6), grid=(5.0, 15.0, 50.0, 150.0)),
    ),
    each_trial=True,
    family="drift",
    order=110,
)
DRIFT_TEMPERATURE = Sensing(
    "drift_temperature",
    SensingPort.CHANNEL,
    thermal_drift,
    (amplitude("thermal", "1/K", Normal(0.0, 0.05), "for 1 degC, in the channel's unit", 1e3),),
    family="drift",
    order=120,
)
