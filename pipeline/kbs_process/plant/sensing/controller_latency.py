"""Latency of the controller beyond its whole cycles, or of the driver that makes the field."""

from __future__ import annotations

from kbs_process.plant.effect import Normal, Parameter
from kbs_process.plant.sensing.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(rate: Array, latency: float) -> Array:
    r"""Change of the field that comes late.

    Equation: $\Delta\theta_f = -\tau \dot\theta_f$.
    Units: rad/s, s -> rad.
    Validity: open loop, to first order in the latency. Where the field was recorded, what comes after the record: the
        current in a motor's phase follows its command by the winding's time constant.
    Source: G. F. Franklin, J. D. Powell, M. Workman, Digital Control of Dynamic Systems (1998), chapter 5.
    """
    return -latency * rate


CONTROLLER_LATENCY = Sensing(
    name="controller_latency",
    port=SensingPort.CONTROLLER,
    equation=change,
    parameters=(
        Parameter("latency", "s", Normal(0.0, 0.05), "of the field", (-10.0, 10.0), role="amplitude"),
    ),
    reference="G. F. Franklin, J. D. Powell, M. Workman, Digital Control of Dynamic Systems (1998), chapter 5",
    behind_record=True,
)
