"""Drift of a channel in proportion to time."""

from __future__ import annotations

from kbs_process.plant.effect import Normal, Parameter
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(time: Array, drift: float) -> Array:
    r"""Change of a channel with time.

    Equation: $\Delta y = d t$.
    Units: s, a second of the channel's unit -> the channel's.
    Validity: where no slope of each recording is removed before.
    Source: VDI/VDE 2638, Characteristics of force transducers: terms and definitions (2008), creep and zero drift.
    """
    return drift * time


DRIFT_LINEAR = Sensing(
    name="drift_linear",
    order=100,
    port=SensingPort.CHANNEL,
    equation=change,
    parameters=(
        Parameter("drift", "1/s", Normal(0.0, 1e-3), "in the channel's unit", (-10.0, 10.0), role="amplitude"),
    ),
    reference="VDI/VDE 2638, Characteristics of force transducers (2008)",
    each_trial=True,
)
