"""A clock that stamps late."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.effect import Normal, amplitude
from kbs_process.plant.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def lateness(time: Array, late: float) -> Array:
    r"""By how much the stamps of a clock are late that is set wrong.

    Equation: $y_\mathrm{read}(t) = y(t - \tau)$.
    Units: s, s -> s.
    Validity: one offset all along.
    Source: D. W. Allan, N. Ashby, C. C. Hodge, The science of timekeeping, Hewlett-Packard AN 1289 (1997).
    """
    return np.full_like(time, late)


CLOCK_OFFSET = Sensing(
    "clock_offset",
    SensingPort.STREAM,
    lateness,
    (amplitude("late", "s", Normal(0.0, 0.01), "by which its stamps are late", 10.0),),
    family="offset",
    order=210,
)
