"""Stamps held against the order in which they arrived: odd ones, clocks that were set back, lone ones far off.

A message that comes late leaves a hole where its stamp belongs, and fills it. An odd stamp fills none, and leaves a
hole where it arrived. A clock that was set back leaves no hole, and comes by the same times twice.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from kbs_process.machine_code import njit
from kbs_process.signals.records import Block, Mask, Stamps
from kbs_process.stages.align.ordering import BLOCK, concatenate, select

AHEAD = 512  # samples that wait for those behind them
LONE = 64  # samples that are left out where they lie far from all others, at either end
SET_BACK = 3  # samples that come by times that have been, without a hole that they fill: fewer are odd stamps
REGULAR = 0.6  # share of steps within half a period of their median, without which nothing is judged
LISTED = 64
MOST_ODD, LEAST_ODD = 0.005, 10  # share of samples, and number of places, in which stamps may be odd
OFF = 2.5  # periods off its neighbours in the file, from which on a stamp may be odd


@dataclass(slots=True)
class Arrival:
    """Takes the samples of a stream in file order; the last ones wait until what follows is known.

    Samples that all have one stamp, as where a file was filled up with zeros, are odd however many they are.
    """

    far_ns: int = 10_000_000_000  # at least so far from all others are the lone ones
    odd: int = 0  # samples with odd stamps, left out
    places: int = 0  # where these stood together
    odd_span: tuple[int, int] = (0, 0)  # ns, between which they arrived
    lone: int = 0  # samples far from all others, left out
    lone_by: int = 0  # ns, how far
    set_back: tuple[int, int, int] | None = None  # samples before; ns: since the first, by how much time goes back
    doubled: list[int] = field(default_factory=list)  # ns, times of odd stamps that left no hole where they arrived
    _kept: Block | None = None  # passed on
    _held: Block | None = None
    _first: int = 0  # ns
    _passed: int = 0  # samples that were judged

    @property
    def scattered(self) -> str:
        """Why stamps are no times of samples, where odd ones are everywhere; or nothing."""
        if self.places <= max(MOST_ODD * self._passed, LEAST_ODD):
            return ""
        return (
            f"{self.odd} of {self._passed} stamps do not fit where they stand, in {self.places} places: parts of a "
            "second without their leading zeros or in a wrong unit, or a clock that jumps"
        )

    def push(self, block: Block) -> Block:
        """Take the next samples; return those that can be judged, without odd ones."""
        return self._pass(block if self._held is None else concatenate([self._held, block]), AHEAD)

    def flush(self) -> Block | None:
        """Return what was held back."""
        return None if self._held is None else self._pass(self._held, 0)

    def _pass(self, fresh: Block, ahead: int) -> Block:
        before = 0 if self._kept is None else len(self._kept)
        whole = fresh if self._kept is None else concatenate([self._kept, fresh])
        end = max(len(whole) - ahead, before)
        gone = self._odd(whole, before, end)
        if gone[before:end].any():
            good = whole.stamp[~gone]
            known = np.maximum.accumulate(np.where(gone, good.min() if len(good) else 0, whole.stamp))
            at = known[before:end][gone[before:end]]
            self.odd_span = (self.odd_span[0] if self.odd else int(at[0]), int(at[-1]))
            self.odd += len(at)
            self.places += int(np.count_nonzero(np.diff(gone[before:end].astype(np.int8), prepend=0) > 0))
        far, apart = _far(whole.stamp, ~gone, self.far_ns, first=before == 0, last=ahead == 0)
        if far[before:end].any():
            self.lone, self.lone_by = self.lone + int(np.count_nonzero(far[before:end])), max(self.lone_by, apart)
        gone |= far
        if before == 0 and not gone.all():
            self._first = int(whole.stamp[~gone].min())
        self._passed += end - before
        self._held = select(fresh, slice(end - before, None))
        self._kept = select(whole, np.flatnonzero(~gone[:end])[-BLOCK:])
        return select(whole, before + np.flatnonzero(~gone[before:end]))

    def _odd(self, block: Block, before: int, end: int) -> Mask:
        """Which samples have odd stamps; notes where the clock was set back. Those from `end` on are not judged."""
        stamp, gone = block.stamp, np.zeros(len(block), dtype=np.bool_)
        steps = np.diff(stamp)
        if (steps > 0).all():
            return gone
        period = float(np.median(np.abs(steps)))
        if period <= 0.0 or np.mean(np.abs(np.abs(steps) / period - 1.0) <= 0.5) < REGULAR:
            return gone
        chosen = in_order(stamp)
        index = np.flatnonzero(~chosen)
        line = stamp[chosen]
        place = np.cumsum(chosen)[index]  # of the next that is in order
        previous = np.where(place > 0, line[np.maximum(place - 1, 0)], np.iinfo(np.int64).min)
        following = np.where(place < len(line), line[np.minimum(place, len(line) - 1)], np.iinfo(np.int64).max)
        own = stamp[index]
        off = (own < previous - OFF * period) | (own > following + OFF * period)
        hole = np.searchsorted(line, own)
        outside = (hole == 0) | (hole == len(line))
        low, high = line[np.maximum(hole - 1, 0)], line[np.minimum(hole, len(line) - 1)]
        room = np.where(outside, 0.0, np.rint((high - low) / period) - 1.0)
        same = ~outside & (own == high)
        repeated = same & (
            block.values[np.flatnonzero(chosen)[np.minimum(hole, len(line) - 1)]] == block.values[index]
        ).all(1)
        clash = same | (np.bincount(hole, minlength=len(line) + 1)[hole] > room)
        for run in np.split(np.arange(len(index)), np.flatnonzero(np.diff(index) > 1) + 1):
            if not (clash[run] & ~repeated[run]).all() or index[run[0]] >= end:
                continue
            begin, after = previous[run[0]], following[run[-1]]
            first, last = int(own[run[0]]), int(own[run[-1]])
            inner = place[run[0]] > 0 and place[run[0]] < len(line)
            missing = inner and after - begin > (1.0 + 0.5 * len(run)) * period
            if not off[run].any():
                if inner and not missing and len(self.doubled) < LISTED:
                    self.doubled.append(int(begin))
                continue
            at_start = before == 0 and place[run[0]] == 0 and len(run) <= LONE
            if missing or len(run) < SET_BACK or at_start or first == last == int(own[run].min()):
                # What precedes all that is known may be late, and is judged by its order.
                gone[index[run]] = ~((hole[run] == 0) & (before >= BLOCK))
                if inner and not missing and len(self.doubled) < LISTED:
                    self.doubled.append(int(begin))
            elif self.set_back is None:
                behind = place[run[0]] > 0 and first < begin  # or ahead of those that follow it
                by = begin + period - first if behind else last + period - after
                number = self._passed - before + int(index[run[0]] if behind else index[run[-1]] + 1)
                since = int(begin if behind else last) - (self._first if before else int(stamp[0]))
                self.set_back = (number, since, int(by))
        return gone


def _far(stamp: Stamps, good: Mask, least: int, *, first: bool, last: bool) -> tuple[Mask, int]:
    """Which samples at either end are few, and far from all others; and how far, ns."""
    far, most = np.zeros(len(stamp), dtype=np.bool_), 0
    index = np.flatnonzero(good)
    if len(index) <= 2 * LONE:
        return far, most
    steps = np.diff(stamp[index])
    usual = float(np.median(steps))
    for known, reach, order in ((first, steps, index), (last, steps[::-1], index[::-1])):
        at = int(np.argmax(reach[:LONE]))
        apart = int(reach[at])
        own, others = stamp[order[: at + 1]], stamp[order[at + 1 :]]
        among = np.any((own >= others.min()) & (own <= others.max()))
        if known and apart > max(least, 10.0 * float(reach[:at].sum()), 100.0 * usual) and not among:
            far[order[: at + 1]], most = True, max(most, apart)
    return far, most


@njit(cache=True, error_model="numpy")
def in_order(stamp: Stamps) -> Mask:
    """Mark a longest increasing subsequence of stamps (n,): the samples that are in order."""
    n = len(stamp)
    tails = np.empty(n, dtype=np.int64)  # index of the least end of the sequences of each length
    back = np.empty(n, dtype=np.int64)
    length = 0
    for i in range(n):
        low, high = 0, length
        if length and stamp[tails[length - 1]] < stamp[i]:
            low = length
        while low < high:
            middle = (low + high) // 2
            if stamp[tails[middle]] < stamp[i]:
                low = middle + 1
            else:
                high = middle
        back[i] = tails[low - 1] if low else -1
        tails[low] = i
        length = max(length, low + 1)
    chosen = np.zeros(n, dtype=np.bool_)
    at = tails[length - 1] if length else -1
    while at >= 0:
        chosen[at] = True
        at = back[at]
    return chosen
