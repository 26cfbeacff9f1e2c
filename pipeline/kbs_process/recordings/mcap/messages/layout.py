"""Where the numbers of a message sit, learnt from one message and applied to all that are laid out alike.

A tracer (one for each encoding) walks a single message and returns its `Layout`: the message's length,
guards, and a cell for each number wanted. The guards cover every byte that decided where the next one sits
(lengths, tags, names). A message of the same length that satisfies the guards is laid out in the same way,
by construction; any other is traced itself. So there is one parser, and no assumption without a guard.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from kbs_process.recordings.mcap.framing import MalformedError
from kbs_process.recordings.mcap.kernels import FLOAT64, LITTLE, MISSING, UNSIGNED, ZERO, Bytes, Words, decode
from kbs_process.signals.records import Array, Mask, Stamps

KNOWN_LAYOUTS = 32  # kept for a stream


class Cell(NamedTuple):
    """Where a number sits in a message: `size` bytes from byte `at`, in one of the kernels' forms and kinds."""

    at: int
    size: int
    form: int
    kind: int


LEFT_OUT = Cell(0, 0, ZERO, UNSIGNED)  # a zero, which proto3 does not write
LACKING = Cell(0, 0, MISSING, FLOAT64)  # a number that the message should have and has not


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """The cells of messages that have `length` bytes and satisfy the guards."""

    length: int
    guards: Words  # (g, 3): offset, mask, expected
    clock: Words  # (2, 4), cells of seconds and nanoseconds, or (0, 4)
    cells: Words  # (c, 4)
    lacks: Mask  # (c,)


def layout(payload: bytes, guards: Guards, clock: Sequence[Cell], cells: Sequence[Cell]) -> Layout:
    """Put a layout together; `clock` has the cells of seconds and nanoseconds, or none."""
    for cell in (*clock, *cells):
        if cell.at + cell.size > len(payload):
            raise MalformedError("a number ends behind its message")
    lacks = np.array([cell is LACKING for cell in cells], dtype=np.bool_)
    return Layout(len(payload), guards.words(), _table(clock), _table(cells), lacks)


def _table(cells: Sequence[Cell]) -> Words:
    return np.array(cells, dtype=np.uint64).reshape(-1, len(Cell._fields))


class Guards:
    """Collects bytes that a layout depends on."""

    def __init__(self, payload: bytes) -> None:
        self._payload = payload
        self._bytes: dict[int, int] = {}

    def add(self, at: int, size: int, mask: int = 0xFF) -> None:
        """Guard `size` bytes from `at`, each under `mask`."""
        for i in range(at, at + size):
            self._bytes[i] = self._bytes.get(i, 0) | mask

    def words(self) -> Words:
        """Return the guards as masked words (offset, mask, expected), shape (g, 3)."""
        rows: list[tuple[int, int, int]] = []
        for at in sorted(self._bytes):
            if not rows or at >= rows[-1][0] + 8:
                rows.append((at, 0, 0))
            offset, mask, expected = rows[-1]
            shift = 8 * (at - offset)
            byte = self._bytes[at]
            rows[-1] = (offset, mask | byte << shift, expected | (self._payload[at] & byte) << shift)
        return np.array(rows, dtype=np.uint64).reshape(-1, 3)


@dataclass(frozen=True, slots=True, eq=False)
class Decoded:
    """The messages of one stream in one segment; `good` is False for those that are undecodable."""

    stamp: Stamps  # (n,) ns
    values: Array  # (n, c), NaN where missing
    good: Mask  # (n,)
    present: Mask  # (c,), fields that at least one message has
    lacking: Mask  # (n,), messages that lack a field
    flawless: bool  # all are good, lack nothing, and every number is finite
    reason: str = ""  # why the first of those that are not good is undecodable


@dataclass(frozen=True, slots=True, eq=False)
class _Packed:
    """Several layouts of one stream, side by side as the kernel takes them: see `kernels.decode`."""

    lengths: Words
    ends: Words
    guards: Words
    clocks: Words
    cells: Words
    plain: Mask
    lacks: Mask  # (k, c)
    lack: bool

    @classmethod
    def of(cls, layouts: Sequence[Layout]) -> _Packed:
        cells = np.stack([one.cells for one in layouts])
        usual = (cells[..., 1] == 8) & (cells[..., 2] == LITTLE) & (cells[..., 3] == FLOAT64)
        lacks = np.stack([one.lacks for one in layouts])
        return cls(
            lengths=np.array([one.length for one in layouts], dtype=np.uint64),
            ends=np.cumsum([0, *(len(one.guards) for one in layouts)], dtype=np.uint64),
            guards=np.concatenate([one.guards for one in layouts]),
            clocks=np.stack([one.clock for one in layouts]),
            cells=cells,
            plain=usual.all(axis=1),
            lacks=lacks,
            lack=bool(lacks.any()),
        )


class LayoutDecoder:
    """Decodes a stream by the layouts met so far, the commonest first.

    `trace` returns the layout of one message, and raises `MalformedError` where that contradicts its schema.
    """

    def __init__(self, trace: Callable[[bytes], Layout], columns: int) -> None:
        self._trace = trace
        self._columns = columns
        self._layouts: list[Layout] = []
        self._packed: _Packed | None = None

    def __call__(self, buffer: Bytes, at: Words, size: Words, log: Stamps) -> Decoded:
        job = _Job.of(buffer, at, size, log, self._columns)
        layouts, packed, counts = list(self._layouts), self._packed, [0] * len(self._layouts)
        left = len(at)
        if packed is not None:
            fitted, left = job.apply(packed, slice(None), 0)
            counts = fitted.tolist()
        if left:
            for traced, count in self._trace_others(job, len(layouts)):
                layouts.append(traced)
                counts.append(count)
            packed = _Packed.of(layouts) if layouts else None
        self._remember(layouts, counts)
        present, lacking = np.ones(self._columns, dtype=np.bool_), np.zeros(len(at), dtype=np.bool_)
        lack = packed is None or packed.lack
        if packed is not None and packed.lack:
            used = np.array(counts) > 0
            present = np.logical_or.reduce(~packed.lacks[used], axis=0)
            lacking = job.good & np.logical_or.reduce(packed.lacks, axis=1)[job.which]
        flawless = job.finite and not lack and bool(job.good.all())
        return Decoded(job.stamp, job.values, job.good, present, lacking, flawless, job.reason)

    def _trace_others(self, job: _Job, known: int) -> list[tuple[Layout, int]]:
        """Trace the messages that no known layout fits, and try each new layout on those that follow."""
        fresh: list[tuple[Layout, int]] = []
        for first in np.flatnonzero(job.which < 0).tolist():
            if job.which[first] >= 0:
                continue
            try:
                traced = self._trace(job.payload(first))
            except MalformedError as error:
                job.good[first] = False
                job.reason = job.reason or str(error)
                continue
            # With too many layouts in a segment, comparing all messages with each would cost more than tracing.
            part = slice(first, None if len(fresh) < KNOWN_LAYOUTS else first + 1)
            counts, _ = job.apply(_Packed.of([traced]), part, known + len(fresh))
            fresh.append((traced, int(counts[0])))
        return fresh

    def _remember(self, layouts: Sequence[Layout], counts: Sequence[int]) -> None:
        """Keep the layouts, the commonest first: the kernel tries them in this order."""
        order = sorted(range(len(layouts)), key=counts.__getitem__, reverse=True)[:KNOWN_LAYOUTS]
        kept = [layouts[i] for i in order]
        if kept and kept != self._layouts:
            self._layouts, self._packed = kept, _Packed.of(kept)


@dataclass(slots=True, eq=False)
class _Job:
    """The messages of one segment on their way to numbers."""

    buffer: Bytes
    at: Words
    size: Words
    which: Stamps  # (n,) number of the layout that fitted, or -1
    stamp: Stamps
    values: Array
    good: Mask
    finite: bool = True
    reason: str = ""

    @classmethod
    def of(cls, buffer: Bytes, at: Words, size: Words, log: Stamps, columns: int) -> _Job:
        n = len(at)
        values, good = np.empty((n, columns)), np.ones(n, dtype=np.bool_)
        return cls(buffer, at, size, np.full(n, -1, dtype=np.int64), log.copy(), values, good)

    def payload(self, i: int) -> bytes:
        start = int(self.at[i])
        return self.buffer[start : start + int(self.size[i])].tobytes()

    def apply(self, packed: _Packed, part: slice, number: int) -> tuple[Stamps, int]:
        """Decode what fits one of the layouts, the first of which has this number.

        Return how many messages fitted each, and how many of the part none has fitted so far.
        """
        counts = np.zeros(len(packed.lengths), dtype=np.int64)
        left, finite = decode(
            self.buffer,
            self.at[part],
            self.size[part],
            packed.lengths,
            packed.ends,
            packed.guards,
            packed.clocks,
            packed.cells,
            packed.plain,
            number,
            counts,
            self.which[part],
            self.stamp[part],
            self.values[part],
        )
        self.finite &= finite
        return counts, left
