"""Latency of the field behind its command: of the driver, or of the controller beyond its whole cycles."""

from __future__ import annotations

from kbs_process.plant.effect import Effect, Normal, Parameter, Port


def change(field_rate: float, field_latency: float) -> float:
    r"""Change of the field that comes late.

    Equation: $\theta_f'(t) = \theta_f(t - \tau)$, to first order $\Delta\theta_f = -\tau \dot\theta_f$.
    Units: rad/s, s -> rad.
    Validity: the plant delays the field itself; what is linear in the latency, as its signature is, is off by
        $\ddot\theta_f \tau^2 / 2$ and knows no cycles. A field that comes early goes on as it does, where it is not
        known yet. Where the field was recorded, it is what comes after the record: the current in a motor's phase
        follows its command by the winding's time constant.
    Source: G. F. Franklin, J. D. Powell, M. Workman, Digital Control of Dynamic Systems (1998), chapter 5.
    """
    return -field_latency * field_rate


CONTROLLER_LATENCY = Effect(
    name="controller_latency",
    order=100,
    port=Port.FIELD,
    equation=change,
    parameters=(Parameter("field_latency", "s", Normal(0.0, 0.05), "of the field", (-0.5, 0.5), role="amplitude"),),
    reference="G. F. Franklin, J. D. Powell, M. Workman, Digital Control of Dynamic Systems (1998), chapter 5",
    delay="field_latency",
)
