"""Samples that are dropped while their stamps go on as if they were not."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import Normal, amplitude
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def lateness(time: Array, dropped: float, drop_time: float) -> Array:
    r"""By how much stamps are late after samples were lost: what follows seems to come early.

    Equation: $y_\mathrm{read}(t) = y(t + \tau)$ where $t > t_0$, else $y(t)$.
    Units: s, s, s -> s.
    Validity: one loss, at a time of its own along every trajectory.
    Source: D. W. Allan, N. Ashby, C. C. Hodge, The science of timekeeping, Hewlett-Packard AN 1289 (1997).
    """
    return np.where(time > drop_time, -dropped, 0.0)


CLOCK_DROPS = Sensing(
    "clock_drops",
    SensingPort.STREAM,
    lateness,
    (amplitude("dropped", "s", Normal(0.0, 0.05), "time lost", 10.0),),
    each_trial=True,
    family="drops",
    order=240,
)
