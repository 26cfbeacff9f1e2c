"""What comes late: the controller's set points, so that a cycle begins where the command was before; the field."""

from __future__ import annotations

from kbs_process.plant.effect import Effect, Normal, Port, amplitude


def of_set_points(field_rate: float, set_point_lag: float) -> float:
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


def of_field(field_rate: float, field_latency: float) -> float:
    r"""Change of the field that comes late: of the driver, or of the controller beyond its whole cycles.

    Equation: $\theta_f'(t) = \theta_f(t - \tau)$, to first order $\Delta\theta_f = -\tau \dot\theta_f$.
    Units: rad/s, s -> rad.
    Validity: the plant delays the field itself; what is linear in the latency, as its signature is, is off by
        $\ddot\theta_f \tau^2 / 2$ and knows no cycles. A field that comes early goes on as it does, where it is not
        known yet. Where the field was recorded, it is what comes after the record: the current in a motor's phase
        follows its command by the winding's time constant.
    Source: G. F. Franklin, J. D. Powell, M. Workman, Digital Control of Dynamic Systems (1998), chapter 5.
    """
    return -field_latency * field_rate


CONTROLLER_LAG = Effect(
    "controller_lag",
    Port.FIELD,
    of_set_points,
    (amplitude("set_point_lag", "s", Normal(0.0, 0.05), "of the set points", 0.5),),
    delay="set_point_lag",
    of_set_points=True,
    recorded=True,
    family="latency",
    order=90,
)
CONTROLLER_LATENCY = Effect(
    "controller_latency",
    Port.FIELD,
    of_field,
    (amplitude("field_latency", "s", Normal(0.0, 0.05), "of the field", 0.5),),
    delay="field_latency",
    family="latency",
    order=100,
)
