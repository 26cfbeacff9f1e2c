"""From inputs at any inlet to the loads of a rig that its measured motion drives: nothing of it is dynamic."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from kbs_process.diagnosis.screening.inlets import GROUND_PORT, WRENCH_PORT, Inlet
from kbs_process.plant.effect import Port
from kbs_process.plant.moved import grounded, pressed, reading
from kbs_process.rig.model import Rig
from kbs_process.signals.averages import instants
from kbs_process.signals.records import WRENCH_CHANNELS, Array


def respond(rig: Rig, columns: Sequence[Mapping[Inlet, Array]], q: Array) -> Array:
    """Change (n, 6 + joints, m) of `rigid.loads` by columns of inputs, means over the samples' intervals.

    It is that of `plant.moved`. Columns are zero of the floor, and of what has no value on this motion.
    """
    n = len(q)
    changed = np.zeros((n, 6 + len(rig.joints), len(columns)))
    ports = {inlet.port for column in columns for inlet in column}
    wrenches = pressed(rig, q) if WRENCH_PORT in ports else {}
    grounds = grounded(rig, q) if GROUND_PORT in ports else {}
    for m, column in enumerate(columns):
        for inlet, means in column.items():
            port = Port.__members__.get(inlet.port.upper())
            if not np.all(np.isfinite(means)):
                continue
            acting = instants(means[:n])
            if inlet.port == WRENCH_PORT:
                component = WRENCH_CHANNELS.index(inlet.axis)
                changed[:, :, m] += wrenches[inlet.where][:, :, component] * acting[:, None]
            elif inlet.port == GROUND_PORT:
                changed[:, :, m] += grounds[inlet.where] * acting[:, None]
            elif port is not None and inlet.where in rig.joint_names:
                effort = 6 + rig.joint_names.index(inlet.where)
                changed[:, effort, m] += reading(rig.joint(inlet.where), port) * acting
    return changed
