"""From inputs at any inlet to the channels of a rig that its measured motion drives: nothing of it is dynamic."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from kbs_process.diagnosis.inlets import Inlet
from kbs_process.plant.effect import Port
from kbs_process.plant.moved import reading
from kbs_process.rig.model import Rig
from kbs_process.signals.averages import instants
from kbs_process.signals.records import Array


def respond(
    rig: Rig, columns: Sequence[Mapping[Inlet, Array]], channels: Sequence[str], samples: int
) -> Array:
    """Change (n, c, m) of the recorded loads `channels` by columns of inputs, means over the samples' intervals.

    Torques within a joint's drive show in its effort alone. What the laboratory exerts on a link is not covered: such
    a column is zero, as is one of a law that this motion takes out of bounds.
    """
    changed = np.zeros((samples, len(channels), len(columns)))
    for m, column in enumerate(columns):
        for inlet, means in column.items():
            channel = f"{inlet.where}.effort"
            port = Port.__members__.get(inlet.port.upper())
            if channel in channels and port is not None and np.all(np.isfinite(means)):
                slope = reading(rig.joint(inlet.where), port)
                changed[:, channels.index(channel), m] += slope * instants(means[:samples])
    return changed
