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

from kbs_process.ingest.framing import MalformedError
from kbs_process.ingest.kernels import FLOAT64, MISSING, UNSIGNED, ZERO, Bytes, Words, decode
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


class LayoutDecoder:
    """Decodes a stream by the layouts met so far, the commonest first.

    `trace` returns the layout of one message, and raises `MalformedError` where that contradicts its schema.
    """

    def __init__(self, trace: Callable[[bytes], Layout], columns: int) -> None:
        self._trace = trace
        self._columns = columns
        self._layouts: list[Layout] = []

    def __call__(self, buffer: Bytes, at: Words, size: Words, log: Stamps) -> Decoded:
        n = len(at)
        stamp, values = log.copy(), np.empty((n, self._columns))
        good, todo = np.ones(n, dtype=np.bool_), np.ones(n, dtype=np.bool_)
        present, lacking = np.zeros(self._columns, dtype=np.bool_), np.zeros(n, dtype=np.bool_)
        left = n

        def apply(known: Layout, part: slice) -> int:
            nonlocal present
            before = todo[part].copy() if known.lacks.any() else None
            args = (np.uint64(known.length), known.guards, known.clock, known.cells)
            done = decode(buffer, at[part], size[part], *args, todo[part], stamp[part], values[part])
            if done:
                present |= ~known.lacks
                if before is not None:
                    lacking[part] |= before & ~todo[part]
            return done

        counts: list[int] = []
        for known in self._layouts:
            counts.append(apply(known, slice(None)) if left else 0)
            left -= counts[-1]
        # The commonest first: most segments then need no more than that one.
        order = sorted(range(len(counts)), key=counts.__getitem__, reverse=True)
        self._layouts = [self._layouts[i] for i in order]
        if not left:
            return Decoded(stamp, values, good, present, lacking)
        fresh = 0
        for first in np.flatnonzero(todo).tolist():
            if not todo[first]:
                continue
            start = int(at[first])
            try:
                traced = self._trace(buffer[start : start + int(size[first])].tobytes())
            except MalformedError:
                good[first] = todo[first] = False
                continue
            # With too many layouts in a segment, comparing all messages with each would cost more than tracing.
            fresh += 1
            apply(traced, slice(first, None if fresh <= KNOWN_LAYOUTS else first + 1))
            if fresh <= KNOWN_LAYOUTS:
                self._layouts = [traced, *self._layouts[: KNOWN_LAYOUTS - 1]]
        return Decoded(stamp, values, good, present, lacking)
