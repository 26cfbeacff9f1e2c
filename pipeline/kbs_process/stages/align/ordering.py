"""Samples of one stream in the order of their stamps, each stamp once, whatever the chunks of the file.

Everything behind `Reblock` sees blocks of one fixed size, so that no result depends on how the reader cut
the file, to the last bit.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from kbs_process.signals.records import Array, Block, Mask, Stamps
from kbs_process.stages.align.spikes import by_turns

BLOCK = 8192  # samples; also the window within which a late sample is still put in its place
TWICE = 0.3  # share of repeated stamps, beyond which two sources may bring them
STRAY_NS = 10_000_000_000  # a stamp that disagrees by more with the recorder's clock is no time of this run


def concatenate(blocks: list[Block]) -> Block:
    """Join blocks of one stream."""
    if len(blocks) == 1:
        return blocks[0]
    return Block(
        np.concatenate([block.stamp for block in blocks]),
        np.concatenate([block.log for block in blocks]),
        np.concatenate([block.values for block in blocks]),
    )


def select(block: Block, rows: Mask | Stamps | slice) -> Block:
    """Return some rows of a block."""
    return Block(block.stamp[rows], block.log[rows], block.values[rows])


class Reblock:
    """Cut chunks of any size into blocks of exactly `BLOCK` samples (the last one excepted)."""

    def __init__(self) -> None:
        self._pieces: list[Block] = []
        self._held = 0

    def push(self, chunk: Block) -> Iterator[Block]:
        start = 0
        while self._held + len(chunk) - start >= BLOCK:
            stop = start + BLOCK - self._held
            self._pieces.append(select(chunk, slice(start, stop)))
            yield concatenate(self._pieces)
            self._pieces, self._held, start = [], 0, stop
        if start < len(chunk):
            self._pieces.append(select(chunk, slice(start, None)))
            self._held += len(chunk) - start

    def flush(self) -> Iterator[Block]:
        if self._pieces:
            yield concatenate(self._pieces)
        self._pieces, self._held = [], 0


@dataclass(frozen=True, slots=True)
class ClockSense:
    """Which of a stream's two clocks can be used, judged on its first block."""

    stamp: bool  # the sensor's clock advances
    log: bool  # the recorder's clock advances like the time that is used


def judge(block: Block) -> ClockSense:
    """Compare how far both clocks advance from the first half of a block to its second.

    Medians of the halves, so that single wild stamps do not decide. A stamp clock that stands still is no
    clock; a recorder clock that disagrees by more than 10 % (a converted file, written in one go) tells
    nothing about the sensor's.
    """
    if len(block) < 2:
        return ClockSense(stamp=bool(block.stamp.any()), log=False)
    half = len(block) // 2
    stamp = float(np.median(block.stamp[half:] - block.stamp[0]) - np.median(block.stamp[:half] - block.stamp[0]))
    log = float(np.median(block.log[half:] - block.log[0]) - np.median(block.log[:half] - block.log[0]))
    if stamp <= 0.0:
        return ClockSense(stamp=False, log=log > 0.0)
    return ClockSense(stamp=True, log=abs(log / stamp - 1.0) < 0.1)


class Orderer:
    """Sort samples within a window of one block, drop repeated stamps, and count what was wrong."""

    def __init__(self, sense: ClockSense) -> None:
        self._sense = sense
        self._pending: Block | None = None
        self._last = np.iinfo(np.int64).min  # newest stamp already released
        self._offset: int | None = None  # recorder's clock less sensor's, of the block before
        self.repeats = 0
        self.displaced = 0  # arrived after a younger sample
        self.late = 0  # of these, too late to be put in place: dropped
        self.mixed = False  # two sources bring readings with one stamp
        self.stray = 0  # stamps far from any time of the run: dropped

    def push(self, block: Block) -> Block | None:
        """Take the next block in file order; return the samples that nothing can precede any more."""
        block = self._without_strays(block)
        if len(block) == 0:
            return None
        before = self._pending
        floor = self._last if before is None else before.stamp[-1]
        if block.stamp[0] > floor and bool(np.all(np.diff(block.stamp) > 0)):
            self._pending = block
            return self._release(before)
        merged = block if before is None else concatenate([before, block])
        newest = np.maximum.accumulate(merged.stamp)
        self.displaced += int(np.count_nonzero(merged.stamp[1:] < newest[:-1]))
        merged = select(merged, np.argsort(merged.stamp, kind="stable"))
        fresh = np.concatenate(([True], np.diff(merged.stamp) > 0))
        late = merged.stamp < self._last
        self.late += int(np.count_nonzero(late))
        fresh &= merged.stamp > self._last
        repeats = ~fresh & ~late
        self.repeats += int(np.count_nonzero(repeats))
        if np.mean(repeats) > TWICE:
            self.mixed |= any(by_turns(column) for column in merged.values.T)
        merged = select(merged, fresh)
        cut = len(merged) - BLOCK
        if cut < BLOCK // 2:  # the first block released must be long enough to find the nominal rate in
            cut = 0
        self._pending = select(merged, slice(cut, None)) if len(merged) else None
        return self._release(select(merged, slice(0, cut)))

    def flush(self) -> Block | None:
        pending, self._pending = self._pending, None
        return self._release(pending)

    def _release(self, block: Block | None) -> Block | None:
        if block is None or len(block) == 0:
            return None
        self._last = int(block.stamp[-1])
        return block

    def _without_strays(self, block: Block) -> Block:
        if not (self._sense.log and self._sense.stamp):
            return block
        offset = block.log - block.stamp
        centre = int(np.median(offset - offset[0])) + int(offset[0])
        if self._offset is not None and abs(centre - self._offset) > STRAY_NS:
            centre = self._offset
        self._offset = centre
        stray = np.abs(offset - centre) > STRAY_NS
        if not stray.any():
            return block
        self.stray += int(np.count_nonzero(stray))
        return select(block, ~stray)


def finite_rows(values: Array) -> Mask | None:
    """Return which rows are finite throughout, or None where all are (the usual case, told by one sum)."""
    with np.errstate(invalid="ignore", over="ignore"):
        if np.isfinite(values.sum()):
            return None
    rows = np.asarray(np.isfinite(values).all(axis=1))
    return None if rows.all() else rows
