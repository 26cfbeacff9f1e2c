"""The readings of a stream: how many distinct ones there are, where, and in what steps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from kbs_process.signals.records import Array, Block
from kbs_process.stages.align.condense import LOADS

_BIN = 0.25  # s
_COUNTED = 20  # readings that tell a local rate
_SHORT = 0.9  # of the readings that are needed: as many are enough, at the ends of a window some are missed
_HEAD = 4096  # rows that tell in which steps a channel reads
_STEPS = 4.0  # a channel that changes by more of its steps at a time is not at rest
_ON_GRID = 0.02  # of a step


@dataclass(slots=True)
class Readings:
    """The readings of one stream: how many in each quarter of a second, and the first of them."""

    stamped: dict[int, int] = field(default_factory=dict)  # by quarter: with a stamp of their own
    changed: dict[int, int] = field(default_factory=dict)  # and not the same as the one before
    head: list[Array] = field(default_factory=list)
    _rows: int = 0
    _last: tuple[int, Array] | None = None

    def push(self, block: Block) -> None:
        """Count a block's readings; stamps that never advance are the recorder's."""
        stamp = block.stamp if len(block) < 2 or block.stamp[0] != block.stamp[-1] else block.log
        stamp, at = np.unique(stamp, return_index=True)
        values = block.values[at]
        if self._last is not None and stamp[0] == self._last[0]:
            stamp, values = stamp[1:], values[1:]
        if len(stamp) == 0:
            return
        before = values[:1] + np.nan if self._last is None else self._last[1]
        rows = np.concatenate([before, values])
        new = ~np.all((rows[1:] == rows[:-1]) | (np.isnan(rows[1:]) & np.isnan(rows[:-1])), axis=1)
        self._last = int(stamp[-1]), values[-1:].copy()
        quarter = stamp // int(1e9 * _BIN)
        for counts, which in ((self.stamped, quarter), (self.changed, quarter[new])):
            for place, count in zip(*np.unique(which, return_counts=True), strict=True):
                counts[int(place)] = counts.get(int(place), 0) + int(count)
        if self._rows < _HEAD:
            self.head.append(values[: _HEAD - self._rows].copy())
            self._rows += len(self.head[-1])

    def steps(self) -> Array:
        """The step (c,) in which each channel reads, as its first readings show; zero of one that has none."""
        rows = np.concatenate(self.head) if self.head else np.zeros((0, 0))
        return np.array([_step(column) for column in rows.T])

    @property
    def held(self) -> bool:
        """Whether each reading comes several times, which no rounding makes it do."""
        return sum(self.stamped.values()) >= 2 * sum(self.changed.values()) and not self._rounded()

    def slow(self, needed: float, *, at_rest: bool) -> tuple[float, float]:
        """Share of the time in which there are fewer than `needed` distinct readings a second, and the rate there.

        Readings `at_rest` may be the same by rounding. Time without any change is none of it.
        """
        counts = self.stamped if at_rest or self._rounded() else self.changed
        if not counts:
            return 0.0, 0.0
        first, last = min(self.stamped), max(self.stamped)
        length = min(max(1, round(_COUNTED / needed / _BIN)), last - first + 1)
        windows: dict[int, int] = {}
        for place, count in counts.items():
            windows[(place - first) // length] = windows.get((place - first) // length, 0) + count
        windows.pop((last - first + 1) // length, None)  # the last one is not whole
        rates = np.array(list(windows.values())) / (length * _BIN)
        low = rates[rates < _SHORT * needed]
        return (len(low) / len(rates), float(np.median(low))) if len(low) else (0.0, 0.0)

    def _rounded(self) -> bool:
        """Whether all channels change by steps of their rounding, so that the same reading may well come again."""
        rows = np.concatenate(self.head)
        for column, step in zip(rows.T, self.steps(), strict=True):
            change = np.abs(np.diff(column))
            change = change[np.isfinite(change) & (change > 0.0)]
            if len(change) and (step == 0.0 or np.median(change) > _STEPS * step):
                return False
        return True


def white(x: Array) -> Array:
    """Standard deviation of the white noise in readings (n,) or (n, c), whatever else is slow or seldom."""
    rms: Array = 1.4826 * np.median(np.abs(np.diff(x, n=3, axis=0)), axis=0) / np.sqrt(20.0)
    return rms


def _step(x: Array) -> float:
    """The largest step of which all readings are multiples apart; zero where there is none."""
    levels = np.unique(x[np.isfinite(x)])
    apart = np.diff(levels)
    apart = apart[apart > 1e-9 * max(float(np.ptp(levels)), 1e-300)] if len(levels) > 2 else apart[:0]
    if len(apart) == 0:
        return 0.0
    step = float(apart.min())
    multiples = (levels - levels[0]) / step
    return step if np.all(np.abs(multiples - np.rint(multiples)) < _ON_GRID) else 0.0


class Watch:
    """Passes the blocks of a recording on, and counts their readings, stream by stream."""

    def __init__(self) -> None:
        self.streams: dict[str, Readings] = {}

    def __call__(self, blocks: Iterator[tuple[str, Block]]) -> Iterator[tuple[str, Block]]:
        """Yield the blocks as they are."""
        for key, block in blocks:
            if key in (*LOADS, "angle") and len(block):
                self.streams.setdefault(key, Readings()).push(block)
            yield key, block
