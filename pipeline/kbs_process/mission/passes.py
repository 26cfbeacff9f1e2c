"""When each relay satellite can be tracked, and by which angles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kbs_process.mission.geometry import azimuth_elevation, line_of_sight
from kbs_process.mission.model import Limits, Mission, Relay
from kbs_process.mission.profile import State, Transfer, stopping_distance, transfer
from kbs_process.signals.records import Array, Mask


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """A relay satellite as the mechanism sees it, at every cycle."""

    relay: Relay
    u: Array  # (n, 3) line of sight in T
    q: Array  # (n, 2) rad, azimuth wrapped to (-pi, pi]
    rate: Array  # (n, 2) rad/s
    acceleration: Array  # (n, 2) rad/s^2
    in_view: Mask  # (n,) not hidden by the Earth
    usable: Mask  # (n,) in view, and within the mechanism's range and limits
    bridged: Mask  # (n,) usable although off the track, on a bridge over the zenith

    def state(self, k: int, axis: int) -> State:
        """State of one axis that tracks the satellite in cycle k."""
        return State(float(self.q[k, axis]), float(self.rate[k, axis]))


def track(mission: Mission, relay: Relay, t: Array) -> Track:
    """Angles, rates and accelerations that track `relay` at uniform times t (n,) s, a cycle apart.

    Rates and accelerations are central differences over a cycle, the former without the turns of azimuth: they err
    by a third and a twelfth of (cycle / time scale of the motion)^2, at 10 s and 0.1 s by less than 1e-4.
    A cycle is usable only if both axes can still come to rest within their range.
    """
    u, hidden = line_of_sight(mission, relay, t)
    q = azimuth_elevation(u)
    rate, acceleration = _derivatives(np.unwrap(q, axis=0), mission.cycle)
    limits = mission.limits
    stop = q + stopping_distance(rate, limits.acceleration)
    possible = followed(rate, acceleration, limits)
    usable = possible & ~hidden & within(q, limits) & within(stop, limits)
    return Track(relay, u, q, rate, acceleration, ~hidden, usable, np.zeros_like(usable))


def within(q: Array, limits: Limits) -> Mask:
    """Whether angles (n, 2), rad, lie in the mechanism's range, (n,)."""
    inside: Mask = np.all((q >= limits.low) & (q <= limits.high), axis=1)
    return inside


def followed(rate: Array, acceleration: Array, limits: Limits) -> Mask:
    """Whether the mechanism can move at these rates and accelerations (n, 2), (n,)."""
    fast = np.abs(rate).max(axis=1) > limits.rate
    steep = np.abs(acceleration).max(axis=1) > limits.acceleration
    possible: Mask = ~(fast | steep)
    return possible


def _derivatives(q: Array, dt: float) -> tuple[Array, Array]:
    rate = np.gradient(q, dt, axis=0)
    acceleration = np.zeros_like(q)
    acceleration[1:-1] = (q[2:] - 2.0 * q[1:-1] + q[:-2]) / dt**2
    if len(q) > 2:
        acceleration[0], acceleration[-1] = acceleration[1], acceleration[-2]
    return rate, acceleration


def runs(mask: Mask) -> list[tuple[int, int]]:
    """First and one past the last index of every stretch in which `mask` holds."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(np.int8), [0]))))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def rendezvous(start: Track, k0: int, end: Track, k1: int, mission: Mission) -> Array | None:
    """Angles (k1 - k0, 2), rad, that leave one track in cycle k0 and are on another in cycle k1; or None.

    Azimuth turns the way that stays within its range, never through the stop.
    """
    limits, duration = mission.limits, (k1 - k0) * mission.cycle
    made: list[Transfer] = []
    for axis in (0, 1):
        one = transfer(start.state(k0, axis), end.state(k1, axis), duration, limits.rate, limits.acceleration)
        if one is None:
            return None
        made.append(one)
    since = mission.cycle * np.arange(k1 - k0, dtype=np.float64)
    return np.stack([one.position(since) for one in made], axis=1)
