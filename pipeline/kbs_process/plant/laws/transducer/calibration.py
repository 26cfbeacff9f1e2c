"""Errors of the calibration: of a channel's gain, of one entry of the cross-coupling, of a second-order term."""

from __future__ import annotations

from kbs_process.plant.effect import Normal, amplitude
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def of_gain(reading: Array, gain: float) -> Array:
    r"""Change of a channel by an error of its sensitivity.

    Equation: $\Delta y = g y$.
    Units: the channel's, 1 -> the channel's.
    Validity: against the calibration's own uncertainty, which the rig's cross-coupling carries on its diagonal.
    Source: VDI/VDE 2638, Characteristics of force transducers: terms and definitions (2008).
    """
    return gain * reading


def of_coupling(acting: Array, coupling: float) -> Array:
    r"""Change of a channel by another one.

    Equation: $\Delta y_i = x_{ij} y_j$.
    Units: the acting channel's, SI by channel pair -> the channel's.
    Validity: against the calibration's own uncertainty.
    Source: VDI/VDE 2638, Characteristics of force transducers: terms and definitions (2008).
    """
    return coupling * acting


def of_product(acting: Array, interaction: float) -> Array:
    r"""Change of a channel by the product of two: a bridge that a load bends out of its place for another one.

    Equation: $\Delta y_i = x_{ijk} y_j y_k$, `acting` being the product.
    Units: the acting channels' product, SI (the channel's unit over that product's) -> the channel's.
    Validity: one of the 21 second-order terms of a balance's calibration; of the loads that are predicted.
    Source: AIAA R-091A-2020, Calibration and use of internal strain-gage balances with application to wind tunnel
        testing, mathematical model of second order.
    """
    return interaction * acting


CHANNEL_GAIN = Sensing(
    "channel_gain",
    SensingPort.CHANNEL,
    of_gain,
    (amplitude("gain", "1", Normal(0.0, 0.01), "error of the sensitivity", 1.0),),
    family="gain",
    order=10,
)
CROSS_COUPLING = Sensing(
    "cross_coupling",
    SensingPort.COUPLING,
    of_coupling,
    (amplitude("coupling", "SI by channel pair", Normal(0.0, 0.02), "entry of the matrix", 10.0),),
    family="cross-coupling",
    order=20,
)
CHANNEL_INTERACTION = Sensing(
    "channel_interaction",
    SensingPort.PRODUCT,
    of_product,
    (amplitude("interaction", "SI by channel pair", Normal(0.0, 0.02), "second-order term of the calibration", 10.0),),
    whole_band=True,
    family="product",
    order=30,
)
