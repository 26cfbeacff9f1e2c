"""One entry of the transducer's cross-coupling."""

from __future__ import annotations

from kbs_process.plant.effect import Normal, Parameter
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(acting: Array, coupling: float) -> Array:
    r"""Change of a channel by another one.

    Equation: $\Delta y_i = x_{ij} y_j$.
    Units: the acting channel's, SI by channel pair -> the channel's.
    Validity: against the calibration's own uncertainty.
    Source: VDI/VDE 2638, Characteristics of force transducers: terms and definitions (2008).
    """
    return coupling * acting


CROSS_COUPLING = Sensing(
    name="cross_coupling",
    order=20,
    port=SensingPort.COUPLING,
    equation=change,
    parameters=(
        Parameter(
            "coupling", "SI by channel pair", Normal(0.0, 0.02), "entry of the matrix", (-10.0, 10.0), role="amplitude"
        ),
    ),
    reference="VDI/VDE 2638, Characteristics of force transducers (2008)",
)
