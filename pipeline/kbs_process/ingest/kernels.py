"""The compiled loops of the reader: walk a buffer's records, decode messages that are laid out alike.

Positions are unsigned: numba then drops its wrap-around of negative indices, and the eight byte loads of
`_word` become one machine instruction. Whoever calls has checked that messages lie inside the buffer and
cells inside the messages.
"""

from __future__ import annotations

from collections.abc import Callable
from sys import byteorder
from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import njit, types
from numba.extending import intrinsic
from numba.np.arrayobj import make_array
from numpy.typing import NDArray

from kbs_process.signals.records import Array, Mask, Stamps

Bytes = NDArray[np.uint8]
Words = NDArray[np.uint64]

RECORD_HEAD = 9  # opcode, length
MESSAGE_HEAD = 22  # channel, sequence, log time, publish time
SCHEMA, MESSAGE = 3, 5  # with channels between them, all that a chunk may hold
SHORTEST = 14  # content of a schema record without a single letter

# Forms of a cell (how it is written) and kinds (what it means)
LITTLE, BIG, VARINT, ZERO, MISSING = range(5)
FLOAT64, FLOAT32, SIGNED, UNSIGNED, ZIGZAG = range(5)

U = np.uint64
BUFFER = types.Array(types.uint8, 1, "C", readonly=True)
WORDS = types.Array(types.uint64, 1, "C")
TABLE = types.Array(types.uint64, 2, "C")
TABLE_ANY = types.Array(types.uint64, 2, "A")


def _unaligned_load(context: Any, buffer: Any, at: Any) -> Any:
    """Return the little-endian 64-bit word at byte `at`; all of it must lie inside the buffer."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = make_array(signature.args[0])(context, builder, arguments[0]).data  # type: ignore[no-untyped-call]
        place = builder.bitcast(builder.gep(data, [arguments[1]]), ir.IntType(64).as_pointer())
        word = builder.load(place, align=1)
        return word if byteorder == "little" else builder.bswap(word)

    return types.uint64(buffer, at), code


_inner_word: Callable[[Bytes, np.uint64], np.uint64] = intrinsic(_unaligned_load)  # type: ignore[assignment]


@njit(inline="always")
def _word(buffer: Bytes, at: np.uint64) -> np.uint64:
    """Return the little-endian 64-bit word at byte `at`, zeros beyond the end of a buffer of eight bytes or more."""
    start = min(at, U(len(buffer)) - U(8))
    return _inner_word(buffer, start) >> (U(8) * (at - start))


@njit(TABLE(BUFFER, types.uint64, types.boolean), cache=True, nogil=True)
def walk(buffer: Bytes, stop: np.uint64, chunk: bool) -> Words:
    """Walk the records in buffer[:stop]; return a column (opcode, channel, log time, at, size) for each.

    `at` and `size` are those of a message's payload, or of any other record's whole content. The last column
    has opcode 0 and, in `at`, where the walk ended: `stop`, or the first record that does not fit or,
    in a chunk, is no schema, channel or message.
    Two passes, because a list of unknown length costs more than walking twice. Work: O(stop).
    """
    count = 0
    at = U(0)
    while at + U(RECORD_HEAD) <= stop:
        length = _word(buffer, at + U(1))
        if length > stop - at - U(RECORD_HEAD) or (buffer[at] == MESSAGE and length < U(MESSAGE_HEAD)):
            break
        if chunk and not (SCHEMA <= buffer[at] <= MESSAGE and length >= U(SHORTEST)):
            break
        at += U(RECORD_HEAD) + length
        count += 1
    table = np.zeros((5, count + 1), dtype=np.uint64)
    table[3, count] = at
    at = U(0)
    for i in range(count):
        length = _word(buffer, at + U(1))
        table[0, i] = buffer[at]
        at += U(RECORD_HEAD)
        table[3, i] = at
        table[4, i] = length
        if table[0, i] == MESSAGE:
            table[1, i] = U(buffer[at]) | (U(buffer[at + U(1)]) << U(8))
            table[2, i] = _word(buffer, at + U(6))
            table[3, i] = at + U(MESSAGE_HEAD)
            table[4, i] = length - U(MESSAGE_HEAD)
        at += length
    return table


@njit(inline="always")
def _swapped(word: np.uint64) -> np.uint64:
    """Return the word with its bytes in reverse order."""
    word = (word & U(0x00FF00FF00FF00FF)) << U(8) | (word >> U(8)) & U(0x00FF00FF00FF00FF)
    word = (word & U(0x0000FFFF0000FFFF)) << U(16) | (word >> U(16)) & U(0x0000FFFF0000FFFF)
    return word << U(32) | word >> U(32)


@njit(TABLE(TABLE_ANY, types.uint64), cache=True, nogil=True)
def select(table: Words, channel: np.uint64) -> Words:
    """Return (4, n): the place in `table` of each of the channel's messages, its log time, at and size."""
    count = 0
    for i in range(table.shape[1]):
        count += table[1, i] == channel
    chosen = np.empty((4, count), dtype=np.uint64)
    k = 0
    for i in range(table.shape[1]):
        if table[1, i] == channel:
            chosen[0, k] = i
            for row in range(3):
                chosen[1 + row, k] = table[2 + row, i]
            k += 1
    return chosen


@njit(inline="always")
def _load(buffer: Bytes, place: np.uint64, size: np.uint64, form: np.uint64) -> np.uint64:
    """Return the bits of a cell of `size` bytes."""
    if form == LITTLE:
        return _word(buffer, place) & (~U(0) >> (U(64) - U(8) * size))
    if form == BIG:
        return _swapped(_word(buffer, place)) >> (U(64) - U(8) * size)
    bits = _word(buffer, place) & (~U(0) >> (U(64) - U(8) * min(size, U(8))))
    # Seven bits of each byte, put side by side in pairs, fours and eights.
    bits = (bits & U(0x007F007F007F007F)) | (bits & U(0x7F007F007F007F00)) >> U(1)
    bits = (bits & U(0x00003FFF00003FFF)) | (bits & U(0x3FFF00003FFF0000)) >> U(2)
    bits = (bits & U(0x000000000FFFFFFF)) | (bits & U(0x0FFFFFFF00000000)) >> U(4)
    for k in range(U(8), size):
        bits |= (U(buffer[place + k]) & U(0x7F)) << (U(7) * k)
    return bits


@njit(inline="always")
def _signed(bits: np.uint64, size: np.uint64, form: np.uint64) -> np.int64:
    """Return `bits` as two's complement of `size` bytes (a varint's of eight)."""
    shift = np.int64(0) if form == VARINT else np.int64(64) - np.int64(8) * np.int64(size)
    return (np.int64(bits) << shift) >> shift


@njit(
    types.int64(
        BUFFER,
        WORDS,
        WORDS,
        types.uint64,
        TABLE,
        TABLE,
        TABLE,
        types.Array(types.boolean, 1, "C"),
        types.Array(types.int64, 1, "C"),
        types.Array(types.float64, 2, "C"),
    ),
    cache=True,
    nogil=True,
)
def decode(
    buffer: Bytes,
    at: Words,
    size: Words,
    length: np.uint64,
    guards: Words,
    clock: Words,
    cells: Words,
    todo: Mask,
    stamp: Stamps,
    values: Array,
) -> int:
    """Decode those messages still to do that have `length` bytes and satisfy all guards; return how many.

    `guards` (g, 3): offset, mask, expected word. `cells` (c, 4): offset, size, form, kind; `clock` likewise for
    seconds and nanoseconds, or empty. Writes rows of `stamp` and `values`, and clears their `todo`.
    """
    bits = values.view(np.uint64)
    single = np.zeros(1, dtype=np.uint32)
    plain = True  # nothing but float64 in this machine's byte order, the usual case
    for c in range(len(cells)):
        plain &= cells[c, 1] == 8 and cells[c, 2] == LITTLE and cells[c, 3] == FLOAT64
    done = 0
    for i in range(len(at)):
        if not todo[i] or size[i] != length:
            continue
        fits = True
        for g in range(len(guards)):
            fits = _word(buffer, at[i] + guards[g, 0]) & guards[g, 1] == guards[g, 2]
            if not fits:
                break
        if not fits:
            continue
        todo[i] = False
        done += 1
        if len(clock) == 2:
            time = np.int64(0)
            for c in range(2):
                part = _load(buffer, at[i] + clock[c, 0], clock[c, 1], clock[c, 2])
                time = time * 1_000_000_000 + _signed(part, clock[c, 1], clock[c, 2])
            stamp[i] = time
        if plain:
            for c in range(len(cells)):
                bits[i, c] = _inner_word(buffer, at[i] + cells[c, 0])
            continue
        for c in range(len(cells)):
            form, kind = cells[c, 2], cells[c, 3]
            if form == MISSING:
                values[i, c] = np.nan
                continue
            word = _load(buffer, at[i] + cells[c, 0], cells[c, 1], form) if form != ZERO else U(0)
            if kind == FLOAT64:
                bits[i, c] = word
            elif kind == FLOAT32:
                single[0] = word
                values[i, c] = single.view(np.float32)[0]
            elif kind == SIGNED:
                values[i, c] = _signed(word, cells[c, 1], form)
            elif kind == UNSIGNED:
                values[i, c] = word
            else:
                values[i, c] = np.int64(word >> U(1)) ^ -np.int64(word & U(1))
    return done
