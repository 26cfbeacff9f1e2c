"""Lag of the controller's set points: what a cycle begins with is where the command was before."""

from __future__ import annotations

from kbs_process.plant.effect import Effect, Normal, Parameter, Port


def change(field_rate: float, set_point_lag: float) -> float:
    r"""Change of a field whose set points are late.

    Equation: $\theta_f'(t_k) = \theta_f(t_k - \tau)$ at the beginning of each cycle, linear between; to first order
        $\Delta\theta_f = -\tau \dot\theta_f$.
    Units: rad/s, s -> rad.
    Validity: the plant delays the set points themselves. With $\tau$ less than a cycle $T$ it is the mean of this set
        point and the last, $(1 - a) \theta_k + a \theta_{k-1}$, $a = \tau / T$: the controller's smoothing, or its
        computing time made up for by what it knew. A record of the field has it in it. A latency of the driver comes
        after that, and hands on the corners of the command. A lag less than none goes on as the cycle before did,
        where the next set point is not known yet.
    Source: K. J. Astroem, B. Wittenmark, Computer-Controlled Systems (1997), chapters 3 and 9.
    """
    return -set_point_lag * field_rate


CONTROLLER_LAG = Effect(
    name="controller_lag",
    order=90,
    port=Port.FIELD,
    equation=change,
    parameters=(
        Parameter("set_point_lag", "s", Normal(0.0, 0.05), "of the set points", (-0.5, 0.5), role="amplitude"),
    ),
    reference="K. J. Astroem, B. Wittenmark, Computer-Controlled Systems (1997), chapters 3 and 9",
    delay="set_point_lag",
    of_set_points=True,
    recorded=True,
)
