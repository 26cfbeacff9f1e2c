"""Hysteresis of a channel."""

from __future__ import annotations

from kbs_process.plant.effect import LogNormal, Normal, Parameter
from kbs_process.plant.laws.hysteresis.memory import strained
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(reading: Array, loop: float, loop_memory: float) -> Array:
    r"""Change of a channel by what its load was before.

    Equation: $\Delta y = -h z$, $dz/dy = (1 - z \operatorname{sign} dy) / y_0$.
    Units: the channel's, the channel's, the channel's -> the channel's.
    Validity: does not depend on rate; from a virgin state at the recording's start.
    Source: VDI/VDE 2638, Characteristics of force transducers: terms and definitions (2008).
    """
    return -loop * strained(reading, loop_memory)


CHANNEL_HYSTERESIS = Sensing(
    name="channel_hysteresis",
    order=70,
    port=SensingPort.CHANNEL,
    equation=change,
    parameters=(
        Parameter(
            "loop",
            "1",
            Normal(0.0, 0.05),
            "half the loop's width, in the channel's unit",
            (-1e3, 1e3),
            role="amplitude",
        ),
        Parameter(
            "loop_memory",
            "1",
            LogNormal(1.0, 1.0),
            "change of load that closes it, in the channel's unit",
            (1e-9, 1e6),
            grid=(0.003, 0.01, 0.03, 0.1, 0.3),
            over="reading.span",
        ),
    ),
    reference="VDI/VDE 2638, Characteristics of force transducers (2008)",
    whole_band=True,
)
