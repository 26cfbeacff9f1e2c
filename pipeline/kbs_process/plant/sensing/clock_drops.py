"""Samples that are dropped while their stamps go on as if they were not."""

from __future__ import annotations

from kbs_process.plant.effect import Normal, Parameter
from kbs_process.plant.sensing.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(rate: Array, time: Array, dropped: float, drop_time: float) -> Array:
    r"""Change of a reading after samples were lost: what follows seems to come early.

    Equation: $\Delta y = \tau \dot y$ where $t > t_0$, else 0.
    Units: the channel's a second, s, s, s -> the channel's.
    Validity: one loss, at a time of its own along every trajectory; to first order in its length.
    Source: D. W. Allan, N. Ashby, C. C. Hodge, The science of timekeeping, Hewlett-Packard AN 1289 (1997).
    """
    return dropped * (time > drop_time) * rate


CLOCK_DROPS = Sensing(
    name="clock_drops",
    port=SensingPort.STREAM,
    equation=change,
    parameters=(Parameter("dropped", "s", Normal(0.0, 0.05), "time lost", (-10.0, 10.0), role="amplitude"),),
    reference="D. W. Allan, N. Ashby, C. C. Hodge, The science of timekeeping, Hewlett-Packard AN 1289 (1997)",
    each_trial=True,
)
