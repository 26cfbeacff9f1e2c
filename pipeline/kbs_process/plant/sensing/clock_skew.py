"""A clock that runs fast."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import Normal, Parameter
from kbs_process.plant.sensing.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def lateness(time: Array, skew: float) -> Array:
    r"""By how much the stamps of a clock are late that gains on the others.

    Equation: $y_\mathrm{read}(t) = y(t - s (t - t_m))$, $t_m$ being the middle of the recording.
    Units: s, 1 -> s.
    Validity: one rate all along.
    Source: D. W. Allan, N. Ashby, C. C. Hodge, The science of timekeeping, Hewlett-Packard AN 1289 (1997).
    """
    middle = 0.5 * float(time[0] + time[-1])
    return np.asarray(skew * (time - middle), dtype=np.float64)


CLOCK_SKEW = Sensing(
    name="clock_skew",
    port=SensingPort.STREAM,
    equation=lateness,
    parameters=(
        Parameter("skew", "1", Normal(0.0, 1e-4), "rate of the clock, less 1", (-0.1, 0.1), role="amplitude"),
    ),
    reference="D. W. Allan, N. Ashby, C. C. Hodge, The science of timekeeping, Hewlett-Packard AN 1289 (1997)",
)
