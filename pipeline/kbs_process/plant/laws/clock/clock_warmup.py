"""A clock whose oscillator is slow, or fast, until it is warm."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import LogNormal, Normal, Parameter
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def lateness(time: Array, cold_skew: float, cold_time: float) -> Array:
    r"""By how much the stamps of a clock are late whose rate settles as it warms up.

    Equation: $y_\mathrm{read}(t) = y(t - s_0 \theta (1 - e^{-t/\theta}))$.
    Units: s, 1, s -> s.
    Validity: a rate that is off by $s_0$ at the start of every recording, one time constant.
    Source: D. W. Allan, N. Ashby, C. C. Hodge, The science of timekeeping, Hewlett-Packard AN 1289 (1997).
    """
    return np.asarray(cold_skew * cold_time * -np.expm1(-time / cold_time), dtype=np.float64)


CLOCK_WARMUP = Sensing(
    name="clock_warmup",
    order=230,
    port=SensingPort.STREAM,
    equation=lateness,
    parameters=(
        Parameter("cold_skew", "1", Normal(0.0, 1e-4), "rate of the cold clock, less 1", (-0.1, 0.1), role="amplitude"),
        Parameter(
            "cold_time",
            "s",
            LogNormal(60.0, 1.0),
            "time constant of its warming up",
            (1.0, 1e5),
            grid=(0.15, 0.5, 1.5),
            over="time.span",
        ),
    ),
    reference="D. W. Allan, N. Ashby, C. C. Hodge, The science of timekeeping, Hewlett-Packard AN 1289 (1997)",
)
