"""Hysteresis of the gear's windup."""

from __future__ import annotations

from kbs_process.plant.effect import Effect, LogNormal, Normal, Parameter, Port, State


def torque(
    rotor_rate: float, joint_rate: float, ratio: float, wound: float, windup_loss: float, windup_memory: float
) -> tuple[float, float]:
    r"""Torque of the gear on the output by friction between flexspline and teeth, which the windup has to overcome.

    Equation: $T = T_h z$, $\dot z = (v - |v| z) / x_0$ with the rate of windup $v = \omega_r/R - \omega_l$.
    Units: rad/s, rad/s, 1, 1, N m, rad -> N m, 1/s.
    Validity: loops of the windup alone; they do not depend on rate (P. R. Dahl's law).
    Source: R. Dhaouadi, F. H. Ghorbel, P. S. Gandhi, A new dynamic model of hysteresis in harmonic drives, IEEE Trans.
        Industrial Electronics 50 (2003) 1165.
    """
    rate = rotor_rate / ratio - joint_rate
    return windup_loss * wound, (rate - abs(rate) * wound) / windup_memory


TRANSMISSION_HYSTERESIS = Effect(
    name="transmission_hysteresis",
    order=220,
    port=Port.TRANSMISSION,
    equation=torque,
    parameters=(
        Parameter(
            "windup_loss", "N m", Normal(0.0, 0.5), "half height of the loop", (-50.0, 50.0), role="amplitude", dry=True
        ),
        Parameter(
            "windup_memory",
            "rad",
            LogNormal(5e-5, 1.0),
            "windup after a reversal over which it builds up",
            (1e-6, 0.1),
            grid=(1e-5, 5e-5, 2e-4),
        ),
    ),
    reference="R. Dhaouadi, F. H. Ghorbel, P. S. Gandhi, A new dynamic model of hysteresis in harmonic drives, IEEE "
    "Trans. Industrial Electronics 50 (2003) 1165",
    states=(State("wound", "1", 0.0, "share of the loop's half height"),),
)
