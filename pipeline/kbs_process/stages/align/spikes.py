"""Single bad samples of a stream at its full rate, and steps that nothing can make: found beside all physics.

With x'' the second difference, s its robust scale (1.4826 times the median of |x''|) and M its largest value in the
samples around: a spike is one to three samples (any number up to seven, if all read the same) that lie off the cubic
through two neighbours on either side by more than 6 s and 3 M, where these neighbours agree among themselves. White
noise of standard deviation sigma has s = 2.4 sigma. An impact rings: M is large then, and nothing is a spike. A step is
a difference between neighbours that is so much off those around it, and lasts.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numba
import numpy as np

from kbs_process.signals.records import Array, Mask, Stamps

AROUND = 64  # samples on either side that give the scale; the nearest 16 give M
NEAR = 16
LONGEST, LONGEST_SAME = 3, 7  # samples of a spike
SCALES, LARGEST = 6.0, 3.0  # of s and of M
CODES = 3.0  # of the least difference between readings that was met
STEP_LARGEST = 4.0  # a step's share of the largest second difference of the whole recording
FASTEST = 100.0  # rad/s^2 that no antenna reaches
SLOWEST_S = 0.05  # period of samples, beyond which a rig may well get from one place to another in between
MOST_STEPS = 3  # more of them are how the signal is
LISTED = 1000
TURNS, TURNS_SHARE = 20, 0.01  # changes between two levels in a block, and their share of it
APART = 30.0  # of what the next but one sample differs by


def by_turns(x: Array) -> bool:
    """Whether samples (n,) come from two sources: they change between two levels, and back after one or two samples.

    A tone next to half the sampling rate does that as well, but its phase drifts: what was up comes to be down.
    """
    if len(x) < 2 * TURNS:
        return False
    d = np.diff(x)
    jump = np.flatnonzero(np.abs(d) > APART * max(np.quantile(np.abs(x[2:] - x[:-2]), 0.25), 1e-300))
    if len(jump) < max(TURNS, TURNS_SHARE * len(x)):
        return False
    pieces = np.array_split(jump, len(jump) // TURNS)  # what the two differ by may change its sign
    return float(np.mean([_to_and_fro(piece, d[piece]) for piece in pieces])) > 0.8


def _to_and_fro(jump: Stamps, size: Array) -> bool:
    """Whether jumps at these samples lead to and fro between two levels, one of which is held for shorter."""
    up = size[:-1] > 0.0
    if up.all() or not up.any() or np.mean(np.abs(size[1:] + size[:-1]) < 0.2 * np.abs(size[:-1])) < 0.9:
        return False
    runs = np.diff(jump)
    short, long = sorted((float(runs[up].mean()), float(runs[~up].mean())))
    even = float(np.mean((jump[:-1] % 2 == 0) == up))
    return short < 2.0 and (long > 1.5 * short or abs(even - 0.5) > 0.45)


@dataclass(frozen=True, slots=True)
class Oddity:
    """One spike or step of one channel."""

    channel: int
    first: int  # ns
    last: int  # ns
    by: float  # largest deviation


@dataclass(slots=True)
class Spikes:
    """Passes samples on with their spikes interpolated, `AROUND` samples late; notes spikes and steps."""

    turning: Array  # (c,) 1 where a channel is an angle, which has no step of a full turn
    period: float  # s
    keep: bool = False  # leave spikes in, and tell all the same
    spikes: list[Oddity] = field(default_factory=list)
    blows: list[Oddity] = field(default_factory=list)  # of several channels and samples at once: kept
    steps: list[Oddity] = field(default_factory=list)
    unlisted: int = 0
    mixed: Oddity | None = None  # a channel that two sources bring by turns
    _code: Array | None = None  # (c,) least difference between readings
    _largest: Array | None = None  # (c,) second difference beside spikes and steps
    _stamp: Stamps | None = None
    _x: Array | None = None
    _done: int = 0  # rows of them that were passed on

    def push(self, stamp: Stamps, values: Array) -> tuple[Stamps, Array]:
        """Take samples (n,), (n, c); return those that what follows cannot change."""
        if self._stamp is None or self._x is None:
            self._stamp, self._x = stamp, values.copy()
        else:
            self._stamp = np.concatenate([self._stamp, stamp])
            self._x = np.concatenate([self._x, values])
        return self._pass(max(len(self._stamp) - AROUND, self._done))

    def flush(self) -> tuple[Stamps, Array] | None:
        """Return what was held back."""
        return None if self._stamp is None else self._pass(len(self._stamp))

    def _pass(self, end: int) -> tuple[Stamps, Array]:
        assert self._stamp is not None and self._x is not None
        stamp, x, done = self._stamp, self._x, self._done
        channels = x.shape[1]
        if self._code is None or self._largest is None:
            self._code, self._largest = np.full(channels, np.inf), np.zeros(channels)
        gap = np.concatenate([[False], np.diff(stamp) > 1.5e9 * self.period])
        found: list[tuple[int, int, int, float]] = []
        before = x.copy() if self.keep else x
        for channel in range(channels) if end > done else ():
            column = np.ascontiguousarray(x[:, channel])
            step = np.abs(np.diff(column[max(done - 1, 0) :]))
            self._code[channel] = min(self._code[channel], step[step > 0.0].min(initial=np.inf))
            turn = 2.0 * np.pi if self.turning[channel] else 0.0
            *places, largest = _find(column, gap, turn, done, end, self._code[channel])
            self._largest[channel] = max(self._largest[channel], largest)
            if self.mixed is None and by_turns(column[done:end]):
                by = float(np.quantile(np.abs(np.diff(column[done:end])), 0.95))
                self.mixed = Oddity(channel, int(stamp[done]), int(stamp[end - 1]), by)
            found += [(channel, *one) for one in zip(*(each.tolist() for each in places), strict=True)]
            if len(places[0]):
                before = x.copy() if before is x else before
                x[:, channel] = column
        self._note(found, stamp, x, before)
        if self.keep:
            x = before
        start = max(end - 2 * AROUND, 0)
        ready = stamp[done:end], x[done:end].copy()
        self._stamp, self._x, self._done = stamp[start:], x[start:].copy(), end - start
        return ready

    def _note(self, found: list[tuple[int, int, int, float]], stamp: Stamps, x: Array, before: Array) -> None:
        """Note spikes and steps; give samples back that several channels are off in together, as after a blow."""
        for channel, first, stop, by in found:
            one = Oddity(channel, int(stamp[first]), int(stamp[abs(stop) - 1]), by)
            several = sum(first < abs(end) and begin < stop for _, begin, end, _ in found)
            rows = before[first : max(stop, first), channel]
            if stop < 0:
                kind = self.steps
            elif len(rows) > 1 and several > 1 and not self.turning.any() and not (rows == rows[0]).all():
                kind = self.blows
                x[first:stop, channel] = rows
            else:
                kind = self.spikes
            if len(kind) < LISTED:
                kind.append(one)
            else:
                self.unlisted += kind is self.spikes

    def lasting(self) -> list[Oddity]:
        """Steps of channels that change so fast at no other time, and seldom."""
        found: list[Oddity] = []
        for channel, largest in enumerate([] if self._largest is None else self._largest.tolist()):
            own = [one for one in self.steps if one.channel == channel]
            least = max(STEP_LARGEST * largest, FASTEST * self.period**2 if self.turning[channel] else 0.0)
            if len(own) <= MOST_STEPS and self.period <= SLOWEST_S:
                found += [one for one in own if abs(one.by) > least]
        return found


@numba.njit(cache=True, error_model="numpy")
def _find(x: Array, gap: Mask, period: float, begin: int, end: int, code: float) -> tuple[Stamps, Stamps, Array, float]:
    """Find spikes and steps that start in [begin, end), and interpolate spikes in x.

    Returns where each starts and stops (a step: less than zero), by how much it is off, and the largest second
    difference beside them. `gap` says before which samples some are missing.
    """
    n = len(x)
    d = np.zeros(n)  # x[i] - x[i - 1]
    for i in range(1, n):
        d[i] = x[i] - x[i - 1]
        if period > 0.0:
            d[i] -= period * np.rint(d[i] / period)
    dd = np.zeros(n)  # at the middle one of three
    for i in range(1, n - 1):
        dd[i] = 0.0 if gap[i] or gap[i + 1] else abs(d[i + 1] - d[i])
    starts, stops, off = [0][:0], [0][:0], [0.0][:0]
    scale = 1.4826 * np.median(dd[1 : n - 1]) if n > 2 else 0.0
    floor = CODES * code if np.isfinite(code) else 0.0
    odd = np.zeros(n, dtype=np.bool_)
    i = max(begin - 1, 1)
    while i < min(end, n - 1):
        if odd[i] or dd[i] <= max(SCALES * scale, floor) / 2.0:
            i += 1
            continue
        low, high = max(i - AROUND, 1), min(i + AROUND, n - 1)
        s = 1.4826 * np.median(dd[low:high])
        if dd[i] <= max(SCALES * s, floor) / 2.0:
            i += 1
            continue
        found = False
        for m in range(1, LONGEST_SAME + 1):
            for a in range(max(i - m + 1, 2), i + 2):
                b = a + m - 1  # a..b are off
                if b + 2 >= n or found or a < begin:
                    continue
                if m > LONGEST:
                    same = True
                    for k in range(a + 1, b + 1):
                        same = same and x[k] == x[a]
                    if not same:
                        continue
                most = 0.0
                for k in range(max(a - NEAR, 1), min(b + NEAR + 1, n - 1)):
                    if k < a - 1 or k > b + 1:
                        most = max(most, dd[k])
                l1, l0 = -d[a - 1], 0.0  # relative to x[a - 1]
                r0 = x[b + 1] - x[a - 1]
                if period > 0.0:
                    r0 -= period * np.rint(r0 / period)
                r1 = r0 + d[b + 2]
                limit = max(SCALES * s, LARGEST * most, floor)
                least = np.inf
                worst = 0.0
                for k in range(a, b + 1):
                    p = _cubic(float(k - a + 1), float(m + 1), l1, l0, r0, r1)
                    dev = x[k] - x[a - 1] - p
                    if period > 0.0:
                        dev -= period * np.rint(dev / period)
                    least = min(least, abs(dev))
                    worst = dev if abs(dev) > abs(worst) else worst
                across = abs(r0 - 0.5 * (d[a - 1] + d[b + 2]) * (m + 1))
                if least > limit and across <= 0.35 * least:
                    base = x[a - 1]
                    for k in range(a, b + 1):
                        x[k] = base + _cubic(float(k - a + 1), float(m + 1), l1, l0, r0, r1)
                    for k in range(a - 1, b + 2):
                        odd[k] = True
                    starts.append(a)
                    stops.append(b + 1)
                    off.append(worst)
                    found = True
        if not found and i >= 2 + NEAR // 2 and i + 3 + NEAR // 2 < n and i >= begin:
            # A step from i to i + 1: dd is large at both, and nowhere near.
            most = 0.0
            for k in range(i - NEAR // 2, i + 2 + NEAR // 2):
                if k < i or k > i + 1:
                    most = max(most, dd[k])
            by = d[i + 1] - 0.5 * (d[i] + d[i + 2])
            still = x[i] == x[i - 1] and x[i - 1] == x[i - 2]
            still_after = x[i + 1] == x[i + 2] and x[i + 2] == x[i + 3]
            if abs(by) > max(2.0 * SCALES * s, 2.0 * LARGEST * most, floor) and not (
                period == 0.0 and s > 0.0 and (still or still_after)  # is held
            ):
                odd[i] = odd[i + 1] = True
                starts.append(i + 1)
                stops.append(-(i + 2))
                off.append(by)
        i += 1
    largest = 0.0
    for k in range(max(begin, 1), min(end, n - 1)):
        if not odd[k]:
            largest = max(largest, dd[k])
    return np.array(starts, dtype=np.int64), np.array(stops, dtype=np.int64), np.array(off), largest


@numba.njit(cache=True, error_model="numpy")
def _cubic(at: float, right: float, l1: float, l0: float, r0: float, r1: float) -> float:
    """The cubic through (-1, l1), (0, l0), (right, r0) and (right + 1, r1)."""
    c, e = right, right + 1.0
    total = l1 * at * (at - c) * (at - e) / (-1.0 * (-1.0 - c) * (-1.0 - e))
    total += l0 * (at + 1.0) * (at - c) * (at - e) / (c * e)
    total += r0 * (at + 1.0) * at * (at - e) / ((c + 1.0) * c * (c - e))
    total += r1 * (at + 1.0) * at * (at - c) / ((e + 1.0) * e * (e - c))
    return total
