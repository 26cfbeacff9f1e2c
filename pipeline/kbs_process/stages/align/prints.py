"""Prints of runs of successive readings, by which a part of a recording is found again, whatever its place."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from kbs_process.signals.records import Array, Block, Stamps

Hashes = NDArray[np.uint64]
DOUBLINGS = 5
RUN = 2**DOUBLINGS  # readings: of noise of a step and more, no two recordings have as many in common by chance
KEPT = 8  # of so many prints one is kept, by its own value, so that the same are kept everywhere
_FACTOR = 0x9E3779B97F4A7C15  # odd: it mixes bits


@dataclass(slots=True)
class Prints:
    """Prints of one channel. A reading that comes several times on end counts once."""

    found: list[Hashes] = field(default_factory=list)
    at: list[Stamps] = field(default_factory=list)  # ns, where each run begins
    _x: Array = field(default_factory=lambda: np.zeros(0))
    _stamp: Stamps = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def push(self, stamp: Stamps, x: Array) -> None:
        """Take in readings (n,) at `stamp` (n,), ns; those that are no numbers are passed over."""
        x, stamp = np.concatenate([self._x, x]), np.concatenate([self._stamp, stamp])
        new = np.isfinite(x) & np.concatenate([[True], x[1:] != x[:-1]])
        x, stamp = x[new], stamp[new]
        self._x, self._stamp = x[-(RUN - 1) :], stamp[-(RUN - 1) :]
        if len(x) < RUN:
            return
        prints = np.ascontiguousarray(x).view(np.uint64) * np.uint64(_FACTOR)
        prints ^= prints >> np.uint64(29)
        for doubling in range(DOUBLINGS):
            width = 2**doubling
            prints = prints[:-width] * np.uint64(pow(_FACTOR, width, 2**64)) + prints[width:]
        prints ^= prints >> np.uint64(32)
        kept = prints % np.uint64(KEPT) == 0
        self.found.append(prints[kept])
        self.at.append(stamp[: -(RUN - 1)][kept])

    def again(self, other: Prints) -> tuple[int, int] | None:
        """When (ns) the first and the last run begins that `other`, or itself at another time, has as well."""
        if not self.found or not other.found:
            return None
        own, at = np.concatenate(self.found), np.concatenate(self.at)
        if other is self:
            _, index, counts = np.unique(own, return_inverse=True, return_counts=True)
            which = counts[index] > 1
        else:
            which = np.isin(own, np.concatenate(other.found))
        return (int(at[which].min()), int(at[which].max())) if which.any() else None


@dataclass(slots=True)
class Printed:
    """Passes the blocks of a recording on, and keeps the prints of the wrench's channels."""

    channels: list[Prints] = field(default_factory=list)

    def __call__(self, blocks: Iterator[tuple[str, Block]]) -> Iterator[tuple[str, Block]]:
        for key, block in blocks:
            if key == "wrench" and len(block):
                self.channels = self.channels or [Prints() for _ in block.values.T]
                for prints, x in zip(self.channels, block.values.T, strict=True):
                    prints.push(block.stamp, x)
            yield key, block
