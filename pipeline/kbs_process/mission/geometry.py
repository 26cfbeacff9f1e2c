"""Lines of sight from the spacecraft to relay satellites, as azimuth and elevation of the mechanism.

Local orbital frame O: z to the zenith, y along the orbit's normal, x forward; T is O turned by the mounting's
attitude. Elevation 0 is then the local horizontal, the Earth's limb lies at -acos(R / r), and the azimuth axis is
the local vertical.
"""

from __future__ import annotations

import numpy as np

from kbs_process.mission import orbit as orbits
from kbs_process.mission.model import Mission, Relay
from kbs_process.signals.frames import cross, from_rotation_vector, rotate
from kbs_process.signals.records import Array, Mask


def local_frame(r: Array, v: Array, *, yaw_steering: bool = False) -> Array:
    """R_IO (n, 3, 3), whose columns are O's axes in inertial axes, at positions r and velocities v (n, 3).

    With yaw steering x follows the velocity over the turning Earth, v - omega x r: a turn about the zenith
    of up to omega r cos(latitude) / v, 4 deg for a polar orbit, that keeps the Doppler shift at nadir zero.
    """
    if yaw_steering:
        v = v - cross(np.array([0.0, 0.0, orbits.EARTH_RATE]), r)
    z = _unit(r)
    y = _unit(cross(r, v))
    return np.stack([cross(y, z), y, z], axis=2)


def line_of_sight(mission: Mission, relay: Relay, t: Array) -> tuple[Array, Mask]:
    """Unit vector (n, 3) in T's axes to a relay satellite at t (n,) s, and whether the Earth hides it (n,).

    Without light time and aberration: together 5e-5 rad at most, and the antenna's command carries neither.
    """
    r, v = orbits.spacecraft(mission.orbit, t)
    target = orbits.relay(relay, mission.orbit, t)
    R_OT = from_rotation_vector(mission.attitude)
    R_IT = local_frame(r, v, yaw_steering=mission.yaw_steering) @ R_OT
    seen = rotate(np.swapaxes(R_IT, 1, 2), _unit(target - r))
    return seen, occulted(r, target, orbits.EARTH_RADIUS + mission.grazing_height)


def occulted(r: Array, target: Array, radius: float) -> Mask:
    """Whether the segment from r to target (n, 3) passes within `radius` m of the Earth's centre.

    The point nearest to the centre lies at r + s (target - r), s = -r . d / d . d, within the segment.
    """
    d = target - r
    s = np.clip(-np.sum(r * d, axis=1) / np.sum(d * d, axis=1), 0.0, 1.0)
    nearest = np.linalg.norm(r + s[:, None] * d, axis=1)
    hidden: Mask = nearest < radius
    return hidden


def azimuth_elevation(u: Array) -> Array:
    """Joint angles (n, 2), rad, that point the boresight along unit vectors u (n, 3) in T.

    u = (cos el cos az, cos el sin az, sin el). Azimuth is wrapped to (-pi, pi]; at the zenith, where it is
    undefined, atan2 gives 0.
    """
    horizontal = np.hypot(u[:, 0], u[:, 1])
    return np.stack([np.arctan2(u[:, 1], u[:, 0]), np.arctan2(u[:, 2], horizontal)], axis=1)


def boresight(q: Array) -> Array:
    """Unit vector (n, 3) in T along which joint angles q (n, 2), rad, point the antenna."""
    az, el = q[:, 0], q[:, 1]
    return np.stack([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)], axis=1)


def separation(a: Array, b: Array) -> Array:
    """Angle (n,), rad, between unit vectors a and b (n, 3); exact to rounding at any angle.

    2 atan2(|a - b|, |a + b|) (Kahan), where acos(a . b) loses half the digits at small angles.
    """
    angle: Array = 2.0 * np.arctan2(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1))
    return angle


def _unit(a: Array) -> Array:
    unit: Array = a / np.linalg.norm(a, axis=1, keepdims=True)
    return unit
