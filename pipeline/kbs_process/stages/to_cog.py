"""The wrench referred to the spacecraft's centre of mass."""

from __future__ import annotations

import numpy as np

from kbs_process.errors import RecordingError
from kbs_process.rig.model import Spacecraft
from kbs_process.signals.frames import from_rotation_vector
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Signal
from kbs_process.signals.spatial import inverse_pose, transform_wrench, wrench_matrix

ASSUMPTION = (
    "Torques at the spacecraft's centre of mass assume that the transducer's interface and the spacecraft move as "
    "one rigid body, and that the fluctuations come from the mechanism and are fed through its structure: forces "
    "that the rig exerts on the article are moved along with them."
)


def to_spacecraft(wrench: Signal, spacecraft: Spacecraft) -> Signal:
    """Return a wrench in T as the same wrench about S's origin in S's axes: T_S = R_ST (T - p x F).

    Raises RecordingError unless all six channels are there: a moment about another point needs the force.
    """
    if wrench.channels != WRENCH_CHANNELS:
        missing = [channel for channel in WRENCH_CHANNELS if channel not in wrench.channels]
        raise RecordingError(
            f"channels {', '.join(missing)} are missing: a torque cannot be moved without all six",
            remedy="state the requirement at the transducer: frame = 'T'",
        )
    moved = transform_wrench(wrench.values, *pose(spacecraft))
    return wrench.derive(moved, "moved to the spacecraft's centre of mass", frame="S")


def pose(spacecraft: Spacecraft) -> tuple[Array, Array]:
    """Return R_ST and r_ST, which place T in S."""
    return inverse_pose(from_rotation_vector(spacecraft.attitude.value), spacecraft.position.value)


def sigma_at_spacecraft(sigma: Array, spacecraft: Spacecraft) -> Array:
    """Carry standard deviations (6,) of independent channels from T to S: the root of the sum of squares."""
    combined: Array = np.sqrt(wrench_matrix(*pose(spacecraft)) ** 2 @ sigma**2)
    return combined


def sigma_of_pose(wrench: Signal, spacecraft: Spacecraft) -> Array:
    """Return the rms error (6,) in S that the pose's uncertainty makes of a wrench in T, first order.

    A shift dp of the centre of mass changes the torque by -dp x F; a turn da turns force and torque alike.
    """
    R_ST, _ = pose(spacecraft)
    moved = to_spacecraft(wrench, spacecraft).values[wrench.valid]
    variance = np.zeros(6)
    for axis in range(3):
        shift = R_ST[:, axis] * spacecraft.position.sigma[axis]
        variance[3:] += np.mean(np.cross(shift, moved[:, :3]) ** 2, axis=0)
        turn = R_ST[:, axis] * spacecraft.attitude.sigma[axis]
        for part in (slice(0, 3), slice(3, 6)):
            variance[part] += np.mean(np.cross(turn, moved[:, part]) ** 2, axis=0)
    rms: Array = np.sqrt(variance)
    return rms
