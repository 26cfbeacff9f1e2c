"""Gain of a channel of the transducer."""

from __future__ import annotations

from kbs_process.plant.effect import Normal, Parameter
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(reading: Array, gain: float) -> Array:
    r"""Change of a channel by an error of its sensitivity.

    Equation: $\Delta y = g y$.
    Units: the channel's, 1 -> the channel's.
    Validity: against the calibration's own uncertainty, which the rig's cross-coupling carries on its diagonal.
    Source: VDI/VDE 2638, Characteristics of force transducers: terms and definitions (2008).
    """
    return gain * reading


CHANNEL_GAIN = Sensing(
    name="channel_gain",
    order=10,
    port=SensingPort.CHANNEL,
    equation=change,
    parameters=(Parameter("gain", "1", Normal(0.0, 0.01), "error of the sensitivity", (-1.0, 1.0), role="amplitude"),),
    reference="VDI/VDE 2638, Characteristics of force transducers (2008)",
)
