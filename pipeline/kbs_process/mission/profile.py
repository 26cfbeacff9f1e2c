"""Transfers of one axis between two states of motion in a given time, within a rate and an acceleration limit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kbs_process.signals.records import Array

_ROUNDS = 200  # of bisection: more than a double has digits


@dataclass(frozen=True, slots=True)
class State:
    """Position, rad, and rate, rad/s, of one axis."""

    position: float
    rate: float


@dataclass(frozen=True, slots=True)
class Transfer:
    """Constant acceleration to a cruising rate, cruise, constant acceleration to the final rate."""

    start: State
    end: State
    duration: float  # s
    cruise: float  # rad/s
    acceleration: float  # rad/s^2, magnitude in both ramps

    def position(self, t: Array) -> Array:
        """Position (n,), rad, at t (n,) s after the start, 0 to `duration`; rate and position are continuous."""
        first = (self.cruise - self.start.rate) / self.acceleration
        last = (self.end.rate - self.cruise) / self.acceleration
        t1, t2 = abs(first), self.duration - abs(last)
        rising = self.start.position + self.start.rate * t + 0.5 * np.copysign(self.acceleration, first) * t**2
        at_cruise = self.start.position + 0.5 * (self.start.rate + self.cruise) * t1
        left = self.duration - t
        falling = self.end.position - self.end.rate * left + 0.5 * np.copysign(self.acceleration, last) * left**2
        position: Array = np.where(t < t1, rising, np.where(t > t2, falling, at_cruise + self.cruise * (t - t1)))
        return position


def transfer(start: State, end: State, duration: float, rate_limit: float, acceleration: float) -> Transfer | None:
    """Return the transfer that takes exactly `duration` s, or None if the limits do not allow it.

    With ramps of magnitude a the distance covered, d(c) = sum of the three phases, grows with the cruising rate
    c (its derivative is the time of cruise), so that bisection finds the one c between the bounds that rate
    limit and duration set: |c - v0| + |v1 - c| <= a T.
    """
    a, v0, v1 = acceleration, start.rate, end.rate
    reach = 0.5 * (a * duration - abs(v1 - v0))
    if reach < 0.0:
        return None
    low = max(min(v0, v1) - reach, -rate_limit)
    high = min(max(v0, v1) + reach, rate_limit)

    def excess(c: float) -> float:
        t1, t3 = abs(c - v0) / a, abs(v1 - c) / a
        covered = 0.5 * (v0 + c) * t1 + c * (duration - t1 - t3) + 0.5 * (c + v1) * t3
        return covered - (end.position - start.position)

    if low > high or excess(low) > 0.0 or excess(high) < 0.0:
        return None
    for _ in range(_ROUNDS):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        low, high = (middle, high) if excess(middle) < 0.0 else (low, middle)
    return Transfer(start, end, duration, 0.5 * (low + high), a)


def stopping_distance(rate: Array, acceleration: float) -> Array:
    """Signed distance (n,), rad, in which an axis at `rate` (n,) comes to rest: v |v| / 2 a."""
    distance: Array = rate * np.abs(rate) / (2.0 * acceleration)
    return distance
