"""From samples at their own times to a uniform grid at the stream's own rate, gaps filled and flagged."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from kbs_process.machine_code import njit
from kbs_process.signals.records import Array, Block, Mask, Stamps

GAP = 1.5  # nominal periods: a longer step is a gap, if the stamps around it do not say that it is jitter
LEFT, RIGHT = 3, 3  # neighbours that the six-point interpolation needs on either side
AROUND = 4  # stamps on either side that a long step is held against
BRIDGED = 1e-3  # error, in the band, up to which a straight line across a gap is no invention
COARSE = 0.2  # of a period: stamps rounded to less are taken as they are
EXACT = 1e-3  # of the step: what lies so close to a regular grid was not rounded
EVEN = 3  # steps of two periods, at even intervals: of fewer nobody can say that they are
SLOPE = 8  # samples on either side of a step that tell how readings go on
CLEAR = 5.0  # sigma that lie between a step of one period and one of two
AROUND_LOG = 16  # log times on either side of a long step, whose mean tells whether the recorder saw it
MOST_MISSING = 32  # samples that are looked for one by one in a block of stamps that are rounded
PIECE = 65536  # grid points made at a time, which bounds what a long gap costs in memory


@dataclass(frozen=True, slots=True)
class Grid:
    """Uniform times first_ns + k period_ns."""

    first_ns: int
    period_ns: float

    @property
    def rate(self) -> float:
        """Hz."""
        return 1e9 / self.period_ns

    def periods(self, stamp: Stamps) -> Array:
        """Time of each stamp in periods from the grid's first point."""
        u: Array = (stamp - self.first_ns) / self.period_ns
        return u


def nominal_grid(stamp: Stamps) -> Grid:
    """Find the grid of increasing stamps (n >= 2).

    The median step tells which steps are of one period, their mean how many periods the others are; a line through
    the stamps over those counts then averages jitter and rounding. A long step between stamps that the stamps around
    it contradict is jitter, and no period more. On 8192 stamps rounded to 1 ns the period is good to 1e-9 of itself and
    better, so the grid stays on the samples of a steady clock for days. Jitter of a fifth of a period is averaged.
    """
    step = np.diff(stamp)
    period = float(step[np.abs(step / np.median(step) - 1.0) <= 0.5].mean())
    y = (stamp - stamp[0]).astype(np.float64)
    index = np.concatenate(([0.0], np.cumsum(counted(y / period))))
    x = index - index.mean()
    return Grid(int(stamp[0]), float(x @ (y - y.mean()) / (x @ x)))


def quantum(stamp: Stamps) -> int:
    """The decimal step, ns, that all stamps are rounded to: 1 where they are not."""
    apart = stamp - stamp[0]
    steps = (one for one in (10**power for power in range(9, 2, -1)))
    return next((one for one in steps if (np.abs(apart - one * np.rint(apart / one)) <= 2).all()), 1)


def evened(block: Block, *, known: bool = False, more: bool = False) -> Stamps | None:
    """A block's stamps (n,), which increase, without their rounding, where that is coarse; else as they are.

    None where `more` of them will tell which.

    A sensor at 999.7 Hz whose stamps are rounded to 1 ms shows a step of 2 ms every 3.3 s. Nothing is missing as long
    as a line through all stamps over their numbers leaves less than the rounding; where samples are missing, it leaves
    more, until each is counted. Times are uncertain by half the rounding at most.
    """
    stamp = block.stamp
    usual = float(np.median(np.diff(stamp))) if len(stamp) > AROUND else np.inf
    step = quantum(stamp) if np.isfinite(usual) else 1
    if step < COARSE * usual:
        return stamp
    if step > 0.75 * usual and not known and not (rounded := _of_rounding(block)):
        return None if more and rounded is None else stamp
    y = (stamp - stamp[0]).astype(np.float64)
    k = np.arange(len(y), dtype=np.float64)
    period = float(np.mean(np.diff(y)[np.diff(y) <= GAP * usual]))
    # Where a step is that long, samples are missing for certain.
    k[1:] += np.cumsum(np.where(np.diff(y) > period + 2.0 * step, np.rint(np.diff(y) / period) - 1.0, 0.0))
    for _ in range(MOST_MISSING):
        x = k - k.mean()
        slope = float(x @ (y - y.mean()) / (x @ x))
        left = y - y.mean() - slope * x
        if np.ptp(left) <= EXACT * step:
            return stamp
        if np.ptp(left) <= 1.1 * step:
            even: Stamps = stamp[0] + np.rint(y.mean() + slope * x).astype(np.int64)
            return even
        # The one sample more, at the long steps, that brings what is left down the most.
        long = np.flatnonzero(np.diff(y) > 1.5 * period)
        if not len(long) or step < 0.5 * period:
            return stamp
        sums = np.cumsum(left[::-1])[::-1]  # correlation of what is left with a step behind each
        k[long[int(np.argmax(sums[long + 1]))] + 1 :] += 1.0
    return stamp


def _of_rounding(block: Block) -> bool | None:
    """Whether steps of two periods are the rounding's: the recorder saw none, or readings change as at other steps.

    Where neither tells, such steps come at even intervals; None where there are too few to say so.
    """
    stamp, log = block.stamp, block.log
    steps = np.diff(stamp)
    usual, mean = float(np.median(steps)), float(steps.mean())
    double = np.flatnonzero(np.rint(steps / mean) == 2.0)
    if len(double) < 2:
        return False
    lag = (log - log[0]) / mean - np.arange(len(log))
    told = not np.array_equal(np.diff(log), steps) and np.std(np.diff(lag)) < 1.0
    inside = double[(double >= AROUND_LOG) & (double + AROUND_LOG < len(log))]
    if told and len(inside):
        rises = [
            np.mean(lag[at + 1 : at + 1 + AROUND_LOG]) - np.mean(lag[at + 1 - AROUND_LOG : at + 1]) for at in inside
        ]
        # A clock that is set makes such a step as well; but then the recorder's time runs at the usual step.
        slow = (np.mean(log[-AROUND_LOG:]) - np.mean(log[:AROUND_LOG])) / (len(log) - AROUND_LOG) - usual
        return bool(np.median(rises) < 0.5 and slow > 0.5 * (mean - usual))
    if np.isfinite(change := _change(block.values, double)):
        return change < 1.5
    apart = np.diff(double)
    ends = max(int(double[0]), len(stamp) - 1 - int(double[-1]))
    even = int(np.ptp(apart)) <= 2 and ends <= int(apart.max()) + 2
    return None if even and len(double) < EVEN else even


def _change(x: Array, at: Stamps) -> float:
    """By how much more readings (n, c) change at the steps `at` than at others, if they go on as around: 1 or 2.

    NaN where they have too much noise, or too little motion, to tell.
    """
    d, at = np.diff(x, axis=0)[SLOPE:-SLOPE], at[(at >= SLOPE) & (at < len(x) - 1 - SLOPE)] - SLOPE
    if not len(at) or len(d) < 2 * len(at) or not np.isfinite(x).all():
        return np.nan
    mean = (x[2 * SLOPE : -1] - x[SLOPE + 2 : 1 - SLOPE] + x[SLOPE - 1 : -SLOPE - 2] - x[: -2 * SLOPE - 1]) / (
        2.0 * SLOPE - 3.0
    )
    variance = np.mean((d - mean) ** 2, axis=0)
    weight = np.divide(1.0, variance, out=np.zeros_like(variance), where=variance > 0.0)
    both, square = (d * mean) @ weight, mean**2 @ weight
    others = np.delete(both, at).sum() / max(np.delete(square, at).sum(), 1e-300)
    own = square[at].sum()
    clear = others > 0.5 and own * others**2 > CLEAR**2
    return float(both[at].sum() / own / others) if clear else np.nan


def counted(u: Array) -> Array:
    """Periods (n - 1,) that each step between times u (n,), in periods, takes: more than one is a gap."""
    step = np.diff(u)
    count = np.where(step > GAP, np.rint(step), 1.0)
    k = np.flatnonzero(count > 1.0)
    # What stamps on both sides are apart, beyond a period for each step between them.
    around = np.full((AROUND, AROUND, len(k)), np.nan)
    for before, after in np.ndindex(AROUND, AROUND):
        first, last = k - before - 1, k + after + 2
        known = (first >= 0) & (last < len(u))
        apart = np.rint(u[last[known]] - u[first[known]])
        around[before, after, known] = apart - (before + after + 2)
    judged = np.isfinite(around).any(axis=(0, 1))
    # Other gaps nearby make it more, nothing makes it less.
    most = np.floor(np.nanmedian(around[:, :, judged].reshape(AROUND**2, -1), axis=0))
    count[k[judged]] = np.maximum(np.minimum(count[k[judged]], most), 1.0)
    return count


def longest_bridged(frequency: float) -> float:
    """Return the longest gap, s, across which a straight line errs by no more than `BRIDGED` at `frequency`, Hz.

    Half way along it a cosine of that frequency is missed by (2 pi f T)^2/8 of its amplitude. What is faster is
    missed by more, and filtered out afterwards.
    """
    return float(np.sqrt(8.0 * BRIDGED) / (2.0 * np.pi * frequency))


class Regridder:
    """Interpolate a stream onto its grid, block by block.

    Samples that lie on the grid pass unchanged. Between samples: Lagrange's polynomial through the six
    nearest, where their spacing is regular to half a period, else a straight line. Worst gain error of the
    former, half way between samples, 5/1024 (2 pi f T)^6: 8e-5 at 8 Hz sampled at 100 Hz, 3e-7 at 240 Hz;
    of the latter (2 pi f T)^2/8. Points in gaps longer than `bridged`, s, are flagged as invented.
    """

    def __init__(self, grid: Grid, bridged: float = 0.0) -> None:
        self._bridged = bridged * grid.rate  # periods
        self._on_grid = max(1e-6, 1.0 / grid.period_ns)  # periods; stamps are rounded to 1 ns
        self._u: Array = np.empty(0)
        self._x: Array = np.empty((0, 0))
        self._next = 0  # grid index to be made next

    def push(self, u: Array, values: Array) -> Iterator[tuple[Array, Mask | None]]:
        """Take samples (n, c) at increasing times u (n,) in periods; yield grid rows and their flags."""
        if len(u) == 0:
            return
        if len(self._u):
            u = np.concatenate((self._u, u))
            values = np.concatenate((self._x, values))
        end = len(u) - RIGHT  # grid points up to this sample have their neighbours
        if end >= 1:
            yield from self._fill(u, values, int(np.floor(u[end - 1] + self._on_grid)) + 1)
        keep = max(end - LEFT, 0)
        self._u, self._x = u[keep:].copy(), values[keep:].copy()

    def flush(self) -> Iterator[tuple[Array, Mask | None]]:
        if len(self._u):
            yield from self._fill(self._u, self._x, int(np.floor(self._u[-1] + self._on_grid)) + 1)

    def _fill(self, u: Array, x: Array, stop: int) -> Iterator[tuple[Array, Mask | None]]:
        n = stop - self._next
        if n <= 0:
            return
        first = int(np.searchsorted(u, self._next - self._on_grid))
        if first + n <= len(u):
            straight = u[first : first + n]
            if np.abs(straight - np.arange(self._next, stop)).max() <= self._on_grid:
                self._next = stop
                yield x[first : first + n], None
                return
        gap = (counted(u) > 1.0) & (np.diff(u) > self._bridged)
        while self._next < stop:
            n = min(stop - self._next, PIECE)
            rows, invented = np.empty((n, x.shape[1])), np.zeros(n, dtype=np.bool_)
            _interpolate(u, x, gap, self._next, self._on_grid, rows, invented)
            self._next += n
            yield rows, invented if invented.any() else None


@njit(cache=True, error_model="numpy")
def _interpolate(u: Array, x: Array, gap: Mask, first: int, on_grid: float, rows: Array, invented: Mask) -> None:
    last = len(u) - 1
    weight = np.empty(6)
    i = 0
    for k in range(len(rows)):
        at = float(first + k)
        if at < u[0] - on_grid:  # the recording's first samples were unusable
            for c in range(x.shape[1]):
                rows[k, c] = x[0, c]
            invented[k] = True
            continue
        while i < last and u[i + 1] <= at:
            i += 1
        near = i if at - u[i] <= on_grid or i == last else (i + 1 if u[i + 1] - at <= on_grid else -1)
        if near >= 0:
            for c in range(x.shape[1]):
                rows[k, c] = x[near, c]
            continue
        step = u[i + 1] - u[i]
        regular = i >= 2 and i + 3 <= last
        if regular:
            for j in range(i - 2, i + 3):
                regular = regular and 0.5 <= u[j + 1] - u[j] <= 1.5
        if regular:
            for j in range(6):
                weight[j] = 1.0
                for m in range(6):
                    if m != j:
                        weight[j] *= (at - u[i - 2 + m]) / (u[i - 2 + j] - u[i - 2 + m])
            for c in range(x.shape[1]):
                total = 0.0
                for j in range(6):
                    total += weight[j] * x[i - 2 + j, c]
                rows[k, c] = total
        else:
            invented[k] = gap[i]
            share = (at - u[i]) / step
            for c in range(x.shape[1]):
                rows[k, c] = x[i, c] + share * (x[i + 1, c] - x[i, c])
