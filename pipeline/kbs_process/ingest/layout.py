"""Where the numbers of a message sit, learnt from one message and applied to all that are laid out alike.

A tracer (one for each encoding) walks a single message and returns its `Layout`: the message's length,
guards, and a cell for each number wanted. The guards cover every byte that decided where the next one sits
(lengths, tags, names). A message of the same length that satisfies the guards is laid out in the same way,
by construction; any other is traced itself. So there is one parser, and no assumption without a guard.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from kbs_process.ingest.framing import MalformedError
from kbs_process.ingest.kernels import Bytes, Words, gather, matches
from kbs_process.signals.records import Array, Mask, Stamps

LITTLE, BIG, VARINT, ABSENT = range(4)
KNOWN_LAYOUTS = 32  # kept for a stream; more are traced one by one

NUMBERS: dict[str, np.dtype[Any]] = {  # name of a number's type -> NumPy's
    "f8": np.dtype(np.float64),
    "f4": np.dtype(np.float32),
    "i1": np.dtype(np.int8),
    "i2": np.dtype(np.int16),
    "i4": np.dtype(np.int32),
    "i8": np.dtype(np.int64),
    "u1": np.dtype(np.uint8),
    "u2": np.dtype(np.uint16),
    "u4": np.dtype(np.uint32),
    "u8": np.dtype(np.uint64),
}
ZIGZAG = "z8"


@dataclass(frozen=True, slots=True)
class Cell:
    """A number of type `kind` in `size` bytes at byte `at` of a message."""

    kind: str
    at: int
    size: int
    form: int


ZERO = Cell("u8", 0, 0, ABSENT)  # what proto3 leaves out


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """The cells of messages that have `length` bytes and satisfy the guards; a None cell is missing."""

    length: int
    guards: Words  # (g, 3): offset, mask, expected
    stamp: tuple[Cell, Cell] | None  # s, ns
    cells: tuple[Cell | None, ...]


class Tracer(Protocol):
    """Finds the layout of one message; raises `MalformedError` where the message contradicts its schema."""

    def __call__(self, payload: bytes) -> Layout: ...


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
    lacking: int  # messages that lack a field


class LayoutDecoder:
    """Decodes a stream by the layouts met so far, the latest first."""

    def __init__(self, tracer: Tracer, columns: int) -> None:
        self._tracer = tracer
        self._columns = columns
        self._layouts: list[Layout] = []

    def __call__(self, buffer: Bytes, at: Words, size: Words, log: Stamps) -> Decoded:
        n = len(at)
        stamp, values = log.copy(), np.zeros((n, self._columns))
        good, todo = np.ones(n, dtype=np.bool_), np.ones(n, dtype=np.bool_)
        present, lacking = np.zeros(self._columns, dtype=np.bool_), 0

        def apply(layout: Layout, which: Mask | slice, places: Words) -> None:
            nonlocal lacking
            if layout.stamp is not None:
                seconds, nanoseconds = read_integers(buffer, places, layout.stamp).T
                stamp[which] = seconds * 1_000_000_000 + nanoseconds
            values[which] = read_numbers(buffer, places, layout.cells)
            for column, cell in enumerate(layout.cells):
                present[column] |= cell is not None
            lacking += len(places) if None in layout.cells else 0

        for layout in self._layouts:
            which = matches(buffer, at, size, np.uint64(layout.length), layout.guards) & todo
            if which.all():
                apply(layout, slice(None), at)
                return Decoded(stamp, values, good, present, lacking)
            if which.any():
                apply(layout, which, at[which])
                todo &= ~which
        fresh = 0
        while todo.any():
            first = int(np.argmax(todo))
            start = int(at[first])
            try:
                layout = self._tracer(buffer[start : start + int(size[first])].tobytes())
            except MalformedError:
                good[first] = todo[first] = False
                continue
            which = np.zeros(n, dtype=np.bool_)
            which[first] = True
            if fresh < KNOWN_LAYOUTS:  # beyond that, comparing costs more than tracing
                which = matches(buffer, at, size, np.uint64(layout.length), layout.guards) & todo
                self._layouts = [layout, *self._layouts[: KNOWN_LAYOUTS - 1]]
                fresh += 1
            apply(layout, which, at[which])
            todo &= ~which
        return Decoded(stamp, values, good, present, lacking)


def read_numbers(buffer: Bytes, at: Words, cells: Sequence[Cell | None]) -> Array:
    """Read the cells of the messages at `at`, shape (messages, cells); NaN where a cell is None."""
    bits = gather(buffer, at, _rows(cells))
    if all(cell is not None and cell.kind == "f8" for cell in cells):
        return bits.view(np.float64)
    values = np.full(bits.shape, np.nan)
    for column, cell in enumerate(cells):
        if cell is not None:
            values[:, column] = _interpret(bits[:, column], cell.kind)
    return values


def read_integers(buffer: Bytes, at: Words, cells: Sequence[Cell]) -> Stamps:
    """Read integer cells of the messages at `at`, shape (messages, cells)."""
    bits = gather(buffer, at, _rows(cells))
    values = np.zeros(bits.shape, dtype=np.int64)
    for column, cell in enumerate(cells):
        values[:, column] = _interpret(bits[:, column], cell.kind)
    return values


def _rows(cells: Sequence[Cell | None]) -> Words:
    rows = [(0, 0, ABSENT) if cell is None else (cell.at, cell.size, cell.form) for cell in cells]
    return np.array(rows, dtype=np.uint64).reshape(-1, 3)


def _interpret(bits: Words, kind: str) -> NDArray[Any]:
    """Read the low bytes of each word as a number of type `kind`."""
    if kind == ZIGZAG:
        return (bits >> np.uint64(1)).view(np.int64) ^ -(bits & np.uint64(1)).view(np.int64)
    dtype = NUMBERS[kind]
    return bits.astype(np.dtype(f"u{dtype.itemsize}")).view(dtype)
