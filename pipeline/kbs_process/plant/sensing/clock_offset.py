"""A clock that stamps late."""

from __future__ import annotations

from kbs_process.plant.effect import Normal, Parameter
from kbs_process.plant.sensing.sensing import Sensing, SensingPort
from kbs_process.signals.records import Array


def change(rate: Array, late: float) -> Array:
    r"""Change of a reading whose stamp is late.

    Equation: $\Delta y = -\tau \dot y$.
    Units: the channel's a second, s -> the channel's.
    Validity: to first order in the offset: far below a period of what is recorded.
    Source: D. W. Allan, N. Ashby, C. C. Hodge, The science of timekeeping, Hewlett-Packard AN 1289 (1997).
    """
    return -late * rate


CLOCK_OFFSET = Sensing(
    name="clock_offset",
    port=SensingPort.STREAM,
    equation=change,
    parameters=(
        Parameter(
            "late", "s", Normal(0.0, 0.01), "by which its stamps are late", (-10.0, 10.0), role="amplitude"
        ),
    ),
    reference="D. W. Allan, N. Ashby, C. C. Hodge, The science of timekeeping, Hewlett-Packard AN 1289 (1997)",
)
