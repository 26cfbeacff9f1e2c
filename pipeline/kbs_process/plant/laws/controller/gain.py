"""Gain of the controller's command that is not 1."""

from __future__ import annotations

from kbs_process.plant.effect import Effect, Normal, Port, amplitude


def change(field_travel: float, field_gain: float) -> float:
    r"""Change of the field's motion that a wrong scale of the command makes.

    Equation: $\Delta\theta_f = g (\theta_f - \theta_f(0))$.
    Units: rad, 1 -> rad.
    Validity: Kp and Ki of a closed loop are parameters of the rig. Where the field was recorded there is nothing to
        find.
    Source: G. F. Franklin, J. D. Powell, M. Workman, Digital Control of Dynamic Systems (1998), chapter 5.
    """
    return field_gain * field_travel


CONTROLLER_GAIN = Effect(
    "controller_gain",
    Port.FIELD,
    change,
    (amplitude("field_gain", "1", Normal(0.0, 1e-3), "error of the scale", 0.1),),
    recorded=True,
    family="gain",
    order=70,
)
