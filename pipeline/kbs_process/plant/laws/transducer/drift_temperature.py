"""Drift of a channel with temperature."""

from __future__ import annotations

from kbs_process.plant.effect import Normal, Parameter
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(temperature: Array, thermal: float) -> Array:
    r"""Change of a channel's zero with its temperature.

    Equation: $\Delta y = k (T - T(0))$.
    Units: degC, the channel's for 1 degC -> the channel's.
    Validity: bridge and article at one temperature; needs its recording.
    Source: VDI/VDE 2638, Characteristics of force transducers: terms and definitions (2008), creep and zero drift.
    """
    warmer: Array = temperature - temperature[0]
    return thermal * warmer


DRIFT_TEMPERATURE = Sensing(
    name="drift_temperature",
    order=120,
    port=SensingPort.CHANNEL,
    equation=change,
    parameters=(
        Parameter(
            "thermal", "1/K", Normal(0.0, 0.05), "for 1 degC, in the channel's unit", (-1e3, 1e3), role="amplitude"
        ),
    ),
    reference="VDI/VDE 2638, Characteristics of force transducers (2008)",
)
