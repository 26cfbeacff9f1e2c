"""Single bad samples of a stream at its full rate, lost stretches, and steps that nothing can make.

With x'' the second difference, s its robust scale (1.4826 times the median of |x''|) and M its largest value in the
samples around: a spike is one to three samples that lie off the cubic through two neighbours on either side by more
than 6 s and 3 M, where these neighbours agree among themselves. White noise of standard deviation sigma has
s = 2.4 sigma. An impact rings: M is large then, and nothing is a spike. Of several spikes next to each other, the
samples between go on as those around do. A lost stretch stands still, and begins and ends with a jump. A step is a
difference between neighbours that is so much off those around it, and lasts.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from kbs_process.machine_code import njit
from kbs_process.signals.records import Array, Mask, Stamps
from kbs_process.stages.align.grid import counted

AROUND = 64  # samples on either side that give the scale; the nearest 16 give M
NEAR = 16
LONGEST = 3  # samples of a spike
SCALES, LARGEST = 6.0, 3.0  # of s and of M
CODES = 3.0  # of the least difference between readings that was met
STEP_LARGEST = 4.0  # a step's share of the largest second difference of the whole recording
FASTEST = 100.0  # rad/s^2 that no antenna reaches
SLOWEST_S = 0.05  # period of samples, beyond which a rig may well get from one place to another in between
WRAPS = 0.05  # part of its span by which a channel's jump back may differ from it
MOST_STEPS = 3  # more of them are how the signal is
LISTED = 1000
CLUSTER = 16  # samples, among which some are off and the others go on as before
CROWDED = 10  # of the nearest, that are suspect as well: all that is near gives M then
AGREE = 0.35  # of what spikes are off by, that all beside them agree within
FEW = 5  # times as many the same as a logger repeats each reading are lost
HELD_S = 0.5  # longer than any channel with noise shows one and the same reading
GAP = 1.5  # periods
PUSHED_S = 2.0
PAUSE_S = 1.0  # a longer gap may be a pause, in which the rig moved
PAUSE_RATE = 1.0  # rad/s that no antenna is turned with where its readings are missing
MOST_BAD, LEAST_BAD = 0.01, 10  # spikes in samples, and number, that a signal may have
MOST_TURNS = 1e4
TURNS, TURNS_SHARE = 20, 0.1  # changes between two levels in a block, and their share of it
SHAKEN = 10.0  # of the usual second difference
APART = 30.0  # of what the next but one sample differs by


def by_turns(x: Array) -> bool:
    """Whether samples (n,) come from two sources: they change between two levels, and back after one or two samples, or
    by chance.

    A tone next to half the sampling rate does that as well, but its phase drifts: what was up comes to be down.
    Nor are these readings that are undecided between neighbouring codes.
    """
    if len(x) < 2 * TURNS:
        return False
    d = np.diff(x)
    size, second = np.abs(d), np.abs(x[2:] - x[:-2])
    floor = CODES * min(float(one[one > 0.0].min(initial=np.inf)) for one in (size, second))
    usual, large = np.quantile(second, 0.25), np.quantile(size, 0.95)
    jump = np.flatnonzero(size > max(APART * usual, 0.2 * large, floor, 1e-300))
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
    by_chance = long < 3.0 and float(runs.std()) > 0.5 * float(runs.mean())
    return by_chance or (short < 2.0 and (long > 1.5 * short or abs(even - 0.5) > 0.45))


def beats(x: Array) -> bool:
    """Whether samples (n,) differ from their neighbours by what swells and vanishes as |cos| does: a tone next to half
    the sampling rate, and no second source, unless it follows what lies between the samples.
    """
    groups = len(x) // AROUND
    if groups < NEAR:
        return False
    rows = x[: groups * AROUND].reshape(groups, AROUND)
    size, between = np.median(np.abs(np.diff(rows)), axis=1), np.median(np.abs(rows[:, 1:] + rows[:, :-1]), axis=1)
    large = np.quantile(size, 0.95)
    share = float(np.mean(size < 0.5 * large))  # 1/3 of whole beats
    again = np.quantile(np.abs(rows[:, 2:] - rows[:, :-2]), 0.9) < 0.5 * large
    related = np.cov(size, between)
    follows = related[0, 1] ** 2 > 0.25 * related[0, 0] * related[1, 1]
    return bool(0.1 < share < 0.6 and again and not follows)


@dataclass(frozen=True, slots=True)
class Oddity:
    """One spike, step or lost stretch of one channel."""

    channel: int
    first: int  # ns
    last: int  # ns
    by: float  # largest deviation; the reading that stands still
    count: int = 1  # samples
    likely: bool = False  # nothing that a driver filled in: it may be what happened; a step: against all around it


@dataclass(slots=True)
class Spikes:
    """Passes samples on without spikes and lost stretches, a little late; notes these and steps."""

    turning: Array  # (c,) 1 where a channel is an angle, which has no step of a full turn
    period: float  # s
    keep: bool = False  # leave all in, and tell all the same
    lively: bool = True  # no reading is held by a brake or a command
    spikes: list[Oddity] = field(default_factory=list)
    blows: list[Oddity] = field(default_factory=list)  # of several channels and samples at once: kept
    steps: list[Oddity] = field(default_factory=list)
    lost: list[Oddity] = field(default_factory=list)  # stretches that stand still: left out
    gaps: list[Oddity] = field(default_factory=list)  # likely: readings beside them move as nowhere around
    changing: dict[int, Oddity] = field(default_factory=dict)  # channels whose samples change to and fro
    beating: set[int] = field(default_factory=set)  # of these, tones
    samples: int = 0
    _bad: Stamps | None = None  # (c,) spikes
    _code: Array | None = None  # (c,) least difference between readings
    _largest: Array | None = None  # (c,) second difference beside spikes and steps
    _fastest: Array | None = None  # (c,) first difference
    _span: Array | None = None  # (2, c) least and greatest readings
    _gaps: list[Oddity] = field(default_factory=list)  # changes across gaps: `count` periods
    _last: Array | None = None  # (c,) reading that stands still; NaN
    _stamp: Stamps | None = None
    _x: Array | None = None
    _done: int = 0  # rows of them that were passed on
    _ends: list[int] = field(default_factory=list)  # lengths of the blocks of the others

    def push(self, stamp: Stamps, values: Array) -> Iterator[tuple[Stamps, Array]]:
        """Take samples (n,), (n, c); yield those that what follows cannot change, in the blocks in which they came."""
        self._ends.append(len(stamp))
        if self._stamp is None or self._x is None:
            self._stamp, self._x = stamp, values.copy()
        else:
            self._stamp = np.concatenate([self._stamp, stamp])
            self._x = np.concatenate([self._x, values])
        while self._done + self._ends[0] <= len(self._stamp) - self._held - NEAR:
            yield self._pass(self._done + self._ends.pop(0), last=False)

    def flush(self) -> Iterator[tuple[Stamps, Array]]:
        """Yield what was held back."""
        while self._ends:
            yield self._pass(self._done + self._ends.pop(0), last=True)

    @property
    def _held(self) -> int:
        return max(AROUND, int(np.ceil(HELD_S / self.period)))

    def _pass(self, end: int, *, last: bool) -> tuple[Stamps, Array]:
        assert self._stamp is not None and self._x is not None
        stamp, x, done = self._stamp, self._x, self._done
        channels = x.shape[1]
        if self._code is None or self._largest is None or self._fastest is None or self._bad is None:
            self._code, self._bad = np.full(channels, np.inf), np.zeros(channels, dtype=np.int64)
            self._largest, self._fastest = np.zeros(channels), np.zeros(channels)
        still = np.full(channels, np.nan) if self._last is None else self._last
        u = (stamp - stamp[0]) / (1e9 * self.period)
        steps = np.concatenate([[0.0], counted(u)])
        slack = np.abs(np.diff(u, prepend=0.0) - steps)
        gap = steps > GAP
        found: list[tuple[int, int, int, float]] = []
        before, gone = x, np.zeros(len(x), dtype=np.bool_)
        new = np.flatnonzero((x[1:] != x[:-1]).any(axis=1))
        repeated = len(new) > NEAR and not self.turning.any()
        least = max(LONGEST, int(FEW * np.median(np.diff(new)))) if repeated else LONGEST
        for channel in range(channels) if end > done else ():
            column = np.ascontiguousarray(x[:, channel])
            step = np.abs(np.diff(column[max(done - 1, 0) :]))
            self._code[channel] = min(self._code[channel], step[step > 0.0].min(initial=np.inf))
            floor = CODES * self._code[channel] if np.isfinite(self._code[channel]) else 0.0
            turn = 2.0 * np.pi if self.turning[channel] else 0.0
            dead = np.zeros(len(x), dtype=np.bool_)
            if self.lively:
                edges = (self.samples == 0, last)
                dead = find_dead(column, steps, turn, done, end, floor, (least, self._held), still[channel], edges)
                self._note_lost(channel, stamp, column, dead, done, end)
                still[channel] = column[end - 1] if dead[end - 1] else np.nan
                gone |= dead
            *places, largest, fastest = _find(column, steps, slack, turn, done, end, floor, self._held, dead)
            self._largest[channel] = max(self._largest[channel], largest)
            self._fastest[channel] = max(self._fastest[channel], fastest)
            self._note_gaps(channel, stamp, column, turn, 1 + np.flatnonzero(gap[1:]), (done, end))
            if channel not in self.beating and by_turns(x[done:end, channel]):
                by = float(np.quantile(np.abs(np.diff(x[done:end, channel])), 0.95))
                self.changing.setdefault(channel, Oddity(channel, int(stamp[done]), int(stamp[end - 1]), by))
                self.beating |= {channel} if beats(x[done:end, channel]) else set()
            found += [(channel, *one) for one in zip(*(each.tolist() for each in places), strict=True)]
            if len(places[0]):
                before = x.copy() if before is x else before
                x[:, channel] = column
        self._note(found, stamp, steps, x, before)
        read = x[done:end] if self._span is None else np.concatenate([self._span, x[done:end]])
        self._span = np.stack([read.min(axis=0), read.max(axis=0)]) if len(read) else None
        for at in np.flatnonzero(gap[done:end]).tolist() if not self.turning.any() else ():
            first, stop = done + at - 1, done + at
            if len(self.gaps) < LISTED:
                shaken = _shaken(before, steps, stop, stop, set())
                self.gaps.append(Oddity(0, int(stamp[first]), int(stamp[stop]), 0.0, likely=shaken))
        self._last = still
        self.samples += end - done
        kept = slice(done, end) if self.keep else done + np.flatnonzero(~gone[done:end])
        ready = stamp[kept], (before if self.keep else x)[kept].copy()
        if self.keep:
            x = before
        start = max(end - 2 * AROUND, 0)
        self._stamp, self._x, self._done = stamp[start:], x[start:].copy(), end - start
        return ready

    def _note_lost(self, channel: int, stamp: Stamps, x: Array, dead: Mask, done: int, end: int) -> None:
        edges = np.flatnonzero(np.diff(np.concatenate([[False], dead[done:end], [False]]).astype(np.int8)))
        for first, stop in (done + edges.reshape(-1, 2)).tolist():
            own = self.lost[-1] if self.lost and self.lost[-1].channel == channel else None
            one = Oddity(channel, int(stamp[first]), int(stamp[stop - 1]), float(x[first]), stop - first)
            if own is not None and first == done and x[first] == own.by and stamp[first] - own.last < 2e9 * self.period:
                self.lost[-1] = replace(one, first=own.first, count=own.count + one.count)
            elif len(self.lost) < LISTED:
                self.lost.append(one)

    def _note_gaps(
        self, channel: int, stamp: Stamps, x: Array, turn: float, gaps: Stamps, within: tuple[int, int]
    ) -> None:
        """Note by how much a channel changes across short gaps, beyond going on as before and after."""
        for at in gaps.tolist():
            missing = round(float(stamp[at] - stamp[at - 1]) / (1e9 * self.period))
            if not within[0] <= at < within[1] or missing * self.period > PAUSE_S or not NEAR <= at < len(x) - NEAR:
                continue
            slope = np.median(np.diff(x[at - NEAR : at])) + np.median(np.diff(x[at : at + NEAR]))
            by = float(x[at] - x[at - 1] - 0.5 * missing * slope)
            by -= turn * np.rint(by / turn) if turn else 0.0
            self._gaps.append(Oddity(channel, int(stamp[at - 1]), int(stamp[at]), by, missing))

    def _note(
        self, found: list[tuple[int, int, int, float]], stamp: Stamps, steps: Array, x: Array, before: Array
    ) -> None:
        """Note spikes and steps; give samples back that several channels are off in together, as after a blow."""
        assert self._bad is not None
        for channel, first, stop, by in found:
            several = {other for other, begin, end, _ in found if first < abs(end) and begin < stop}
            rows = before[first : max(stop, first), channel]
            read = before[first : max(stop, first)][:, sorted(several)]
            # What a driver fills in for what it lost is zero, or all the same.
            likely = bool((read != read[:1, :1]).any() if read.size > 1 else read.any())
            one = Oddity(channel, int(stamp[first]), int(stamp[abs(stop) - 1]), by, abs(stop) - first, likely)
            if stop < 0:
                kind = self.steps
                around = (slice(max(first - NEAR, 0), first), slice(first, first + NEAR))
                against = all(np.median(np.diff(before[own, channel])) * by < 0.0 for own in around)
                one = replace(one, likely=against)
            elif not self.turning.any() and (
                (len(rows) > 1 and len(several) > 1 and not (rows == rows[0]).all())
                or _shaken(before, steps, first, stop, {c for c, begin, _, _ in found if abs(begin - first) < NEAR})
            ):
                kind = self.blows
                x[first:stop, channel] = rows
            else:
                kind = self.spikes
                self._bad[channel] += 1
            if len(kind) < LISTED:
                kind.append(one)

    @property
    def mixed(self) -> Oddity | None:
        """A channel that two sources bring by turns."""
        return next((one for channel, one in self.changing.items() if channel not in self.beating), None)

    @property
    def wrapped(self) -> Oddity | None:
        """A channel that jumps back by all that it spans, each time that it comes to an end of that."""
        for channel, span in enumerate(() if self._span is None else (self._span[1] - self._span[0]).tolist()):
            own = [one for one in self.steps if one.channel == channel]
            if len(own) > 1 and all(one.likely and abs(abs(one.by) / span - 1.0) < WRAPS for one in own):
                return own[0]
        return None

    def noisy(self) -> tuple[int, int] | None:
        """A channel with more spikes than a signal has, and how many they are."""
        most = 0 if self._bad is None or self.samples == 0 else int(np.argmax(self._bad))
        count = 0 if self._bad is None else int(self._bad[most])
        return (most, count) if count > max(MOST_BAD * self.samples, LEAST_BAD) else None

    def _for_good(self, steps: list[Oddity]) -> list[Oddity]:
        """Steps of a channel without those that go back soon: something pushed, and no angle does so."""
        left: list[Oddity] = []
        for one in steps:
            soon = left and not self.turning[one.channel] and one.first - left[-1].first < 1e9 * PUSHED_S
            if soon and abs(one.by + left[-1].by) < AGREE * abs(one.by):
                left.pop()
            else:
                left.append(one)
        return left

    def lasting(self) -> list[Oddity]:
        """Steps of channels that change so fast at no other time, and seldom."""
        found: list[Oddity] = []
        if self._largest is None or self._fastest is None or self.period > SLOWEST_S:
            return found
        for channel, (largest, fastest) in enumerate(zip(self._largest.tolist(), self._fastest.tolist(), strict=True)):
            own = self._for_good([one for one in self.steps if one.channel == channel])
            least = max(STEP_LARGEST * largest, FASTEST * self.period**2 if self.turning[channel] else 0.0)
            if len(own) <= MOST_STEPS:
                found += [one for one in own if abs(one.by) > least]
            slowest = PAUSE_RATE * self.period if self.turning[channel] else 0.0
            across = [
                one
                for one in self._gaps
                if one.channel == channel and abs(one.by) > one.count * max(1.5 * fastest, slowest) + least
            ]
            found += across if len(across) <= MOST_STEPS else []
        return found


def _shaken(x: Array, steps: Array, first: int, stop: int, off: set[int]) -> bool:
    """Whether channels other than those that are `off` move like nowhere around, periods `steps` (n,) between samples.
    What shook the rig is in all.
    """
    others = [channel for channel in range(x.shape[1]) if channel not in off]
    if not others:
        return False
    around = slice(max(first - AROUND, 0), stop + AROUND)
    slopes = np.diff(x[around][:, others], axis=0) / steps[around][1:, None]
    bent = np.abs(np.diff(slopes, axis=0))
    begin = max(first - around.start - NEAR, 0)
    most = bent[begin : begin + NEAR + stop - first + NEAR].max(0)
    # Of coarse readings, which mostly bend by nothing, those count that do.
    usual = [np.median(own[own > 0.0]) if own.any() else np.inf for own in bent.T]
    return bool(np.any(most > SHAKEN * np.asarray(usual)))


@njit(cache=True, error_model="numpy")
def _differences(x: Array, steps: Array, period: float) -> tuple[Array, Array]:
    """Slopes (n,) before each sample, and by how much they change there; `steps` are periods between samples."""
    n = len(x)
    d, dd = np.zeros(n), np.zeros(n)
    for i in range(1, n):
        d[i] = _turned(x[i] - x[i - 1], period) / steps[i]
    for i in range(1, n - 1):
        dd[i] = abs(d[i + 1] - d[i])
    return d, dd


@njit(cache=True, error_model="numpy")
def _turned(change: float, period: float) -> float:
    """A change without full turns, of which no joint makes that many between samples."""
    if period > 0.0 and abs(change) < MOST_TURNS * period:
        return float(change - period * np.rint(change / period))
    return change


@njit(cache=True, error_model="numpy")
def _scale(dd: Array, low: int, high: int) -> float:
    """The robust scale of second differences, and zero where there are few."""
    low, high = max(low, 1), min(high, len(dd) - 1)
    return 1.4826 * float(np.median(dd[low:high])) if high - low >= NEAR else 0.0


@njit(cache=True, error_model="numpy")
def _most(dd: Array, low: int, high: int) -> float:
    most = 0.0
    for k in range(max(low, 1), min(high, len(dd) - 1)):
        most = max(most, dd[k])
    return most


@njit(cache=True, error_model="numpy")
def find_dead(
    x: Array,
    steps: Array,
    period: float,
    begin: int,
    end: int,
    floor: float,
    lengths: tuple[int, int],
    last: float,
    edges: tuple[bool, bool],
) -> Mask:
    """Mark samples up to `end` that stand still off all others: a channel that was lost for a while.

    They are as many as the first of `lengths`, and begin and end with a jump; or, where the channel has noise, stand
    still for as many as the second. `last` is the reading that stood still up to `begin`, or NaN; `edges` says whether
    x begins and ends with the recording.
    """
    n, (least, held) = len(x), lengths
    d, dd = _differences(x, steps, period)
    dead = np.zeros(n, dtype=np.bool_)
    a = begin
    while a < n and x[a] == last:
        dead[a] = True
        a += 1
    a = max(begin - held, 0) if a == begin else a
    while a < end:
        b = a
        while b + 1 < n and x[b + 1] == x[a]:
            b += 1
        if b - a >= least:
            before, after = _scale(dd, a - AROUND, a - 1), _scale(dd, b + 2, b + 2 + AROUND)
            jump_in = _turned(x[a] - x[a - 1], period) - d[a - 1] if a >= 2 else 0.0
            jump_out = d[b + 1] - d[b + 2] if b + 2 < n else 0.0
            least_in = max(2.0 * SCALES * before, 2.0 * LARGEST * _most(dd, a - NEAR, a - 1), floor)
            least_out = max(2.0 * SCALES * after, 2.0 * LARGEST * _most(dd, b + 2, b + 2 + NEAR), floor)
            goes, comes = a >= NEAR and abs(jump_in) > least_in, abs(jump_out) > least_out and b + NEAR < n
            noisy = max(before, after) > 0.0
            stays = period == 0.0 and noisy and goes and (b + 1 - a >= held or (edges[1] and b == n - 1))
            if (goes and comes and jump_in * jump_out < 0.0) or stays or (edges[0] and a == 0 and comes and noisy):
                dead[max(a, begin) : b + 1] = True
        a = b + 1
    return dead


@njit(cache=True, error_model="numpy")
def _find(
    x: Array, steps: Array, slack: Array, period: float, begin: int, end: int, floor: float, held: int, dead: Mask
) -> tuple[Stamps, Stamps, Array, float, float]:
    """Find spikes and steps that start in [begin, end), and interpolate spikes in x.

    Returns where each starts and stops (a step: less than zero), by how much it is off, and the largest second and
    first difference beside them. `steps` are periods between samples and `slack` by how much their stamps
    are off these; `dead` says which are no readings.
    """
    n = len(x)
    d, dd = _differences(x, steps, period)
    starts, stops, off = [0][:0], [0][:0], [0.0][:0]
    for i in range(n):
        if dead[i]:
            dd[max(i - 1, 0) : i + 2] = 0.0
    scale = _scale(dd, 1, n - 1)
    suspect = np.zeros(n, dtype=np.bool_)
    for i in range(1, n - 1):
        if dd[i] > max(SCALES * scale, floor) / 2.0:
            s = _scale(dd, i - AROUND, i + AROUND)
            timing = (slack[i] + slack[i + 1]) * max(abs(d[i]), abs(d[i + 1]))
            suspect[i] = dd[i] > max(SCALES * s, floor) / 2.0 + timing
    odd = np.zeros(n, dtype=np.bool_)
    dev, at = np.zeros(n), np.cumsum(steps)
    i = max(begin - 1, 1)
    while i < min(end, n - 1):
        if not suspect[i] or odd[i]:
            i += 1
            continue
        last = i
        for k in range(i + 1, min(i + CLUSTER + 4, n - 1)):
            if suspect[k] and k - last <= 2:
                last = k
        a, b = i + 1, last - 1  # may be off; those beside them are not
        s = _scale(dd, i - AROUND, last + AROUND)
        others = 0
        for k in range(max(a - NEAR, 1), min(b + NEAR + 1, n - 1)):
            others += suspect[k] and (k < a - 1 or k > b + 1)
        most = 0.0
        for k in range(max(a - NEAR, 1), min(b + NEAR + 1, n - 1)):
            if (k < a - 1 or k > b + 1) and (others > CROWDED or not suspect[k]):
                most = max(most, dd[k])
        limit = max(SCALES * s, LARGEST * most, floor)
        m = b - a + 1
        if 1 <= m <= CLUSTER and a >= begin and a >= 2 and b + 2 < n:
            l1, r0 = -d[a - 1] * steps[a - 1], _turned(x[b + 1] - x[a - 1], period)
            r1 = r0 + d[b + 2] * steps[b + 2]
            for k in range(a - 1, b + 3):
                limit = max(limit, 3.0 * slack[k] * max(abs(d[a - 1]), abs(d[b + 2])))
            places = (-steps[a - 1], at[b + 1] - at[a - 1], at[b + 2] - at[a - 1])
            least = np.inf
            for k in range(a, b + 1):
                dev[k] = _turned(x[k] - x[a - 1] - _cubic(at[k] - at[a - 1], places, (l1, r0, r1)), period)
                if abs(dev[k]) > limit:
                    least = min(least, abs(dev[k]))
            fits = abs(r0 - 0.5 * (d[a - 1] + d[b + 2]) * places[1]) <= AGREE * least < np.inf
            length = 0
            for k in range(a, b + 1):
                if abs(dev[k]) <= limit:
                    length, fits = 0, fits and abs(dev[k]) <= AGREE * least
                    continue
                length += 1
                fits = fits and length <= LONGEST
            if fits:
                base = x[a - 1]
                for k in range(a, b + 1):
                    if abs(dev[k]) > limit:
                        if k > a and abs(dev[k - 1]) > limit:
                            stops[-1] = k + 1
                            off[-1] = dev[k] if abs(dev[k]) > abs(off[-1]) else off[-1]
                        else:
                            starts.append(k)
                            stops.append(k + 1)
                            off.append(dev[k])
                        x[k] = base + _cubic(at[k] - at[a - 1], places, (l1, r0, r1))
                odd[a - 1 : b + 2] = True
                i = b + 2
                continue
        if i >= NEAR and i + 3 + NEAR // 2 < n and i >= begin and steps[i + 1] < GAP:
            # A step from i to i + 1: dd is large at both, and nowhere near.
            near = max(_most(dd, i - NEAR // 2, i), _most(dd, i + 2, i + 2 + NEAR // 2))
            by = d[i + 1] - 0.5 * (d[i] + d[i + 2])
            still = x[i] == x[i - 1] and x[i - 1] == x[i - 2]
            still_after = x[i + 1] == x[i + 2] and x[i + 2] == x[i + 3]
            if abs(by) > max(2.0 * SCALES * s, 2.0 * LARGEST * near, floor) and not (
                period == 0.0 and ((s > 0.0 and (still or still_after)) or not _stays(x, i, by, held))
            ):
                odd[i] = odd[i + 1] = True
                starts.append(i + 1)
                stops.append(-(i + 2))
                off.append(by)
        i += 1
    largest = fastest = 0.0
    for k in range(max(begin, 1), min(end, n - 1)):
        if not odd[k] and not dead[k]:
            largest = max(largest, dd[k])
            if not odd[k - 1] and not dead[k - 1] and steps[k] < GAP:
                fastest = max(fastest, abs(d[k]))
    return np.array(starts, dtype=np.int64), np.array(stops, dtype=np.int64), np.array(off), largest, fastest


@njit(cache=True, error_model="numpy")
def _stays(x: Array, i: int, by: float, held: int) -> bool:
    """Whether a load is still off by so much a while after sample i, going on as before: a blow dies away."""
    few = NEAR // 2
    at = min(i + held, len(x) - few)
    before, earlier = np.mean(x[i + 1 - few : i + 1]), np.mean(x[i + 1 - 2 * few : i + 1 - few])
    going = before + (before - earlier) / few * (at - i + few - 1)
    return bool(abs(np.mean(x[at : at + few]) - going - by) < 0.5 * abs(by))


@njit(cache=True, error_model="numpy")
def _cubic(at: float, places: tuple[float, float, float], values: tuple[float, float, float]) -> float:
    """The cubic through zero and three more points."""
    total = 0.0
    for i in range(3):
        weight = at / places[i]
        for j in range(3):
            if j != i:
                weight *= (at - places[j]) / (places[i] - places[j])
        total += weight * values[i]
    return total
