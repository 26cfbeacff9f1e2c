"""Gain of the controller, or of its command, that is not 1."""

from __future__ import annotations

from kbs_process.plant.effect import Normal, Parameter
from kbs_process.plant.sensing.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(reading: Array, field_gain: float) -> Array:
    r"""Change of the field's motion that a wrong scale of the command makes.

    Equation: $\Delta\theta_f = g (\theta_f - \theta_f(0))$.
    Units: rad, 1 -> rad.
    Validity: open loop. In a closed loop Kp and Ki are parameters of the rig. Where the field was
        recorded there is nothing to find.
    Source: G. F. Franklin, J. D. Powell, M. Workman, Digital Control of Dynamic Systems (1998), chapter 5.
    """
    turned: Array = reading - reading[0]
    return field_gain * turned


CONTROLLER_GAIN = Sensing(
    name="controller_gain",
    port=SensingPort.CONTROLLER,
    equation=change,
    parameters=(
        Parameter("field_gain", "1", Normal(0.0, 1e-3), "error of the scale", (-1.0, 1.0), role="amplitude"),
    ),
    reference="G. F. Franklin, J. D. Powell, M. Workman, Digital Control of Dynamic Systems (1998), chapter 5",
)
