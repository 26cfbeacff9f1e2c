"""A clock that runs fast."""

from __future__ import annotations

from kbs_process.plant.effect import Normal, Parameter
from kbs_process.plant.sensing.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(rate: Array, time: Array, skew: float) -> Array:
    r"""Change of a reading whose clock gains on the others.

    Equation: $\Delta y = -s (t - t_m) \dot y$, $t_m$ being the middle of the recording.
    Units: the channel's a second, s, 1 -> the channel's.
    Validity: to first order in what it gains over the recording.
    Source: D. W. Allan, N. Ashby, C. C. Hodge, The science of timekeeping, Hewlett-Packard AN 1289 (1997).
    """
    middle = 0.5 * float(time[0] + time[-1])
    return -skew * (time - middle) * rate


CLOCK_SKEW = Sensing(
    name="clock_skew",
    port=SensingPort.STREAM,
    equation=change,
    parameters=(
        Parameter("skew", "1", Normal(0.0, 1e-4), "rate of the clock, less 1", (-0.1, 0.1), role="amplitude"),
    ),
    reference="D. W. Allan, N. Ashby, C. C. Hodge, The science of timekeeping, Hewlett-Packard AN 1289 (1997)",
)
