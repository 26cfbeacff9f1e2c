"""Where points of the links are, as the transducer sees them, along the signals of a plant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kbs_process.diagnosis.experiments.hypothesis import Tapped
from kbs_process.plant.rigid import poses
from kbs_process.rig.model import TRANSDUCER, Rig
from kbs_process.signals.frames import rotate
from kbs_process.signals.records import Array


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """A link's way, from T's origin, in the undeflected T's axes."""

    R: Array  # (m, 3, 3)
    r: Array  # (m, 3) of its origin, m

    def of(self, point: Array) -> Array:
        """Position (m, 3) of a point (3,) that is given in the link's axes, m."""
        return np.asarray(self.r + self.R @ point, dtype=np.float64)


def courses(rig: Rig, tapped: Tapped) -> dict[str, Course]:
    """Those of the links that joints move."""
    columns = {name: k for k, name in enumerate(tapped.columns)}
    links = poses(rig, tapped.values[:, [columns[f"joint_angle.{name}"] for name in rig.joint_names]])
    T = links[TRANSDUCER]
    back = np.swapaxes(T.R, 1, 2)
    return {
        name: Course(back @ link.R, rotate(back, link.r - T.r))
        for name, link in links.items()
        if name in rig.joint_names
    }
