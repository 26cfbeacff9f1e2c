"""Prints of runs of successive readings, by which a part of a recording is found again, rounded or turned, or not.

A print is the signs of a run's fourth differences: what moves slowly, a zero and a gain are not in it, and rounding
seldom changes it. Backwards it has the same signs: of both ways the lesser counts. Of all prints those with the least
values are kept, the same in every recording, each with its readings: these tell whether two runs with the same print
are the same but for rounding.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from math import comb

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from kbs_process.signals.records import Array, Block, Mask, Stamps
from kbs_process.stages.align.ordering import concatenate, select

ORDER, DOUBLINGS = 4, 5  # an even order has no sense of time
RUN = 2**DOUBLINGS + ORDER  # readings: of noise of a step and more, no two runs are the same by chance
KEPT = 1024  # prints of a channel: they find what is some thousandths of a recording
_STEPS = (*(m * 10.0**k for k in range(-12, 2) for m in (1.0, 2.0, 5.0)), *(2.0**k for k in range(-40, 4)))
_ON_GRID = 1e-3  # of a step
_FACTOR = np.uint64(0x9E3779B97F4A7C15)  # odd: it mixes bits


@dataclass(slots=True)
class Prints:
    """The least prints of one channel, and of the same prints no more than two."""

    words: NDArray[np.uint64] = field(default_factory=lambda: np.zeros(0, dtype=np.uint64))
    at: Stamps = field(default_factory=lambda: np.zeros(0, dtype=np.int64))  # ns, where each run begins
    runs: Array = field(default_factory=lambda: np.zeros((0, RUN)))  # from its first

    def push(self, stamp: Stamps, x: Array) -> None:
        """Take the runs of readings (n,) at `stamp` (n,), ns."""
        words = turned = (np.diff(x, ORDER) > 0.0).astype(np.uint64)
        for doubling in range(DOUBLINGS):
            width = 2**doubling
            words = (words[:-width] << np.uint64(width)) | words[width:]
            turned = (turned[width:] << np.uint64(width)) | turned[:-width]
        backwards, words = turned < words, np.minimum(words, turned)
        words *= _FACTOR
        words ^= words >> np.uint64(29)
        words *= _FACTOR
        few = np.flatnonzero(words <= (self.words.max() if len(self.words) == KEPT else ~np.uint64(0)))
        old, words = len(self.words), np.concatenate([self.words, words[few]])
        order = np.argsort(words, kind="stable")
        no_third = np.ones(len(order), dtype=np.bool_)
        no_third[2:] = words[order[2:]] != words[order[:-2]]
        order = order[no_third][:KEPT]
        before, new = order[order < old], order[order >= old]
        self.words = np.concatenate([words[before], words[new]])
        new = few[new - old]
        runs = sliding_window_view(x, RUN)[new]
        runs = np.where(backwards[new, None], runs[:, ::-1], runs)
        self.at = np.concatenate([self.at[before], stamp[new]])
        self.runs = np.concatenate([self.runs[before], runs - runs[:, :1]])


def again(prints: Sequence[Prints], noise: Array) -> dict[tuple[int, int], tuple[int, int]]:
    """When (ns) the first and the last run of a channel begins that an earlier recording, or the same one, has as well.

    By places of both recordings. Two runs are the same if they differ by a constant, or by no more than
    the steps of one, which are twice those of the other; the noise (n,) of each recording, and what each run has of
    it, are more than that.
    """
    words, at = np.concatenate([one.words for one in prints]), np.concatenate([one.at for one in prints])
    runs = np.concatenate([one.runs for one in prints])
    which = np.repeat(np.arange(len(prints)), [len(one.words) for one in prints])
    order = np.lexsort((runs[:, 1], words))  # the same but for rounding are next to each other
    order = np.stack([order[:-1], order[1:]])[:, words[order[1:]] == words[order[:-1]]]
    a, b = np.sort(order, axis=0)
    finer, coarser = np.sort([_step(runs[a]), _step(runs[b])], axis=0)
    apart = np.where(coarser - finer < 0.5 * coarser, 2.0 * _ON_GRID, 1.0) * coarser + _STEPS[0]
    own = np.sqrt(np.mean(np.diff(runs, ORDER) ** 2, axis=1) / comb(2 * ORDER, ORDER))
    least = np.min([noise[which[a]], noise[which[b]], own[a], own[b]], axis=0)
    same = (np.ptp(runs[a] - runs[b], axis=1) <= apart) & (coarser < least)
    found: dict[tuple[int, int], tuple[int, int]] = {}
    for one, other, when in zip(which[a[same]].tolist(), which[b[same]].tolist(), at[b[same]].tolist(), strict=True):
        first, last = found.get((one, other), (when, when))
        found[one, other] = min(first, when), max(last, when)
    return found


def _step(runs: Array) -> Array:
    """The greatest step (n,) of which all readings of each run are multiples apart: least change, or a round one."""
    apart = np.diff(np.sort(runs, axis=1), axis=1)
    least = np.where(apart > _STEPS[0], apart, np.inf).min(axis=1)
    step = np.zeros(len(runs))
    for one in (least, *_STEPS):
        multiples = runs.T / one
        whole = np.all(np.abs(multiples - np.rint(multiples)) < _ON_GRID, axis=0) & (one <= np.ptp(runs, axis=1))
        step = np.where(whole & (one > step), one, step)
    return step


@dataclass(slots=True)
class Printed:
    """Passes the blocks of a recording on, and keeps the prints of the wrench's channels.

    Rows that are no numbers are passed over. Rows that come several times on end count once.
    """

    channels: list[Prints] = field(default_factory=list)
    _rows: Block | None = None  # the last ones

    def __call__(self, blocks: Iterator[tuple[str, Block]]) -> Iterator[tuple[str, Block]]:
        for key, block in blocks:
            if key == "wrench" and len(block):
                self._push(block)
            yield key, block

    def _push(self, block: Block) -> None:
        rows = block if self._rows is None else concatenate([self._rows, block])
        good: Mask = np.all(np.isfinite(rows.values), axis=1)
        rows = select(rows, good)
        new = np.ones(len(rows), dtype=np.bool_)
        new[1:] = np.any(rows.values[1:] != rows.values[:-1], axis=1)
        rows = select(rows, new)
        self.channels = self.channels or [Prints() for _ in block.values.T]
        if len(rows) >= RUN:
            for prints, x in zip(self.channels, rows.values.T, strict=True):
                prints.push(rows.stamp, np.ascontiguousarray(x))
        self._rows = select(rows, slice(-(RUN - 1), None))
