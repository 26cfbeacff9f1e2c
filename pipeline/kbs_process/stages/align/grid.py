"""From samples at their own times to a uniform grid at the stream's own rate, gaps filled and flagged."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from kbs_process.machine_code import njit
from kbs_process.signals.records import Array, Mask, Stamps

GAP = 1.5  # nominal periods: a longer step is a gap, if the stamps around it do not say that it is jitter
LEFT, RIGHT = 3, 3  # neighbours that the six-point interpolation needs on either side
AROUND = 4  # stamps on either side that a long step is held against
BRIDGED = 1e-3  # error, in the band, up to which a straight line across a gap is no invention
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
    most = np.nanmedian(around[:, :, judged].reshape(AROUND**2, -1), axis=0)
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
            rows[k] = x[0]
            invented[k] = True
            continue
        while i < last and u[i + 1] <= at:
            i += 1
        near = i if at - u[i] <= on_grid or i == last else (i + 1 if u[i + 1] - at <= on_grid else -1)
        if near >= 0:
            rows[k] = x[near]
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
