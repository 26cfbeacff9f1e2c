"""A clock that runs fast, or slow: since it was set, or until its oscillator is warm."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import LogNormal, Normal, Parameter, amplitude
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def since_set(time: Array, skew: float, set_at: float) -> Array:
    r"""By how much the stamps of a clock are late that gains on the others.

    Equation: $y_\mathrm{read}(t) = y(t - s (t - t_0))$, $t_0$ being when it was right, after a recording's
        start: before it, negative, of a clock that has gained since it was set.
    Units: s, 1, s -> s.
    Validity: one rate all along, and every recording begun as long after the clock was set: where that differs, the
        offset is each recording's own.
    Source: D. W. Allan, N. Ashby, C. C. Hodge, The science of timekeeping, Hewlett-Packard AN 1289 (1997).
    """
    return np.asarray(skew * (time - set_at), dtype=np.float64)


def until_warm(time: Array, cold_skew: float, cold_time: float, right_at: float) -> Array:
    r"""By how much the stamps of a clock are late whose rate settles as it warms up.

    Equation: $y_\mathrm{read}(t) = y(t - s_0 \theta (e^{-t_0/\theta} - e^{-t/\theta}))$, $t_0$ being when it was
        right, after a recording's start: long after it, of a clock that settles on the right time.
    Units: s, 1, s, s -> s.
    Validity: a rate that is off by $s_0$ at the start of every recording, one time constant.
    Source: D. W. Allan, N. Ashby, C. C. Hodge, The science of timekeeping, Hewlett-Packard AN 1289 (1997).
    """
    settled = np.exp(-right_at / cold_time) - np.exp(-time / cold_time)
    return np.asarray(cold_skew * cold_time * settled, dtype=np.float64)


CLOCK_SKEW = Sensing(
    "clock_skew",
    SensingPort.STREAM,
    since_set,
    (
        amplitude("skew", "1", Normal(0.0, 1e-4), "rate of the clock, less 1", 0.1),
        Parameter(
            "set_at",
            "s",
            Normal(0.0, 30.0),
            "when it was right, after the recording's start",
            (-1e5, 1e5),
            grid=(-3.0, -1.0, -0.3, 0.0, 0.25, 0.5, 0.75, 1.0, 1.3, 2.0),
            over="time.span",
        ),
    ),
    family="skew",
    order=220,
)
CLOCK_WARMUP = Sensing(
    "clock_warmup",
    SensingPort.STREAM,
    until_warm,
    (
        amplitude("cold_skew", "1", Normal(0.0, 1e-4), "rate of the cold clock, less 1", 0.1),
        Parameter(
            "cold_time",
            "s",
            LogNormal(60.0, 1.0),
            "time constant of its warming up",
            (1.0, 1e5),
            grid=(0.15, 0.5, 1.5),
            over="time.span",
        ),
        Parameter(
            "right_at",
            "s",
            Normal(0.0, 30.0),
            "when it was right, after the recording's start",
            (0.0, 1e5),
            grid=(0.0, 1.0, 3.0),
            over="time.span",
        ),
    ),
    family="skew",
    order=230,
)
