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
from numba import types
from numba.extending import intrinsic
from numba.np.arrayobj import make_array
from numpy.typing import NDArray

from kbs_process.machine_code import njit
from kbs_process.signals.records import Array, Mask, Stamps

Bytes = NDArray[np.uint8]
Words = NDArray[np.uint64]

RECORD_HEAD = 9  # opcode, length
MESSAGE_HEAD = 22  # channel, sequence, log time, publish time
SCHEMA, MESSAGE = 3, 5  # with channels between them, all that a chunk may hold
USUAL = 96  # bytes of a record, with its head
SHORTEST = 14  # content of a schema record without a single letter

# Forms of a cell (how it is written) and kinds (what it means)
LITTLE, BIG, VARINT, ZERO, MISSING = range(5)
FLOAT64, FLOAT32, SIGNED, UNSIGNED, ZIGZAG = range(5)

MOST_SECONDS = 1 << 33  # of a stamp: nanoseconds then fit 64 bits
NO_STAMP = -(1 << 63)  # of a message whose seconds or nanoseconds are beyond all that clocks show

U = np.uint64
BUFFER = types.Array(types.uint8, 1, "C", readonly=True)
WORDS = types.Array(types.uint64, 1, "C")
STAMPS = types.Array(types.int64, 1, "C")
TABLE = types.Array(types.uint64, 2, "C")
TABLE_ANY = types.Array(types.uint64, 2, "A")
DONE = types.Tuple((types.int64, types.boolean))  # type: ignore[no-untyped-call]
CUBE = types.Array(types.uint64, 3, "C")


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


@njit(TABLE_ANY(BUFFER, types.uint64, types.boolean), cache=True, nogil=True)
def walk(buffer: Bytes, stop: np.uint64, chunk: bool) -> Words:
    """Walk the records in buffer[:stop]; return a column (opcode, channel, log time, at, size) for each.

    `at` and `size` are those of a message's payload, or of any other record's whole content. The last column
    has opcode 0 and, in `at`, where the walk ended: `stop`, or the first record that does not fit or,
    in a chunk, is no schema, channel or message.
    Room is made for the records that usually stand in so many bytes, and doubled where there are more. Work: O(stop).
    """
    table = np.empty((5, np.int64(stop // U(USUAL)) + 16), dtype=np.uint64)
    count = 0
    at = U(0)
    whole = (
        min(stop, U(len(buffer)) - U(RECORD_HEAD + MESSAGE_HEAD)) if len(buffer) > RECORD_HEAD + MESSAGE_HEAD else U(0)
    )
    while at + U(RECORD_HEAD) <= stop:
        opcode = U(buffer[at])
        length = _inner_word(buffer, at + U(1)) if at < whole else _word(buffer, at + U(1))
        if opcode == U(0) or length > stop - at - U(RECORD_HEAD):
            break  # no record begins with a zero: what was preallocated and not written does
        if opcode == MESSAGE and length < U(MESSAGE_HEAD):
            break
        if chunk and not (SCHEMA <= opcode <= MESSAGE and length >= U(SHORTEST)):
            break
        if count + 1 == table.shape[1]:
            larger = np.empty((5, 2 * table.shape[1]), dtype=np.uint64)
            for row in range(5):
                for column in range(count):
                    larger[row, column] = table[row, column]
            table = larger
        content = at + U(RECORD_HEAD)
        table[0, count] = opcode
        if opcode == MESSAGE:
            table[1, count] = U(buffer[content]) | (U(buffer[content + U(1)]) << U(8))
            table[2, count] = _word(buffer, content + U(6))
            table[3, count] = content + U(MESSAGE_HEAD)
            table[4, count] = length - U(MESSAGE_HEAD)
        else:
            table[1, count] = U(0)
            table[2, count] = U(0)
            table[3, count] = content
            table[4, count] = length
        at = content + length
        count += 1
    for row in range(5):
        table[row, count] = at if row == 3 else U(0)
    return table[:, : count + 1]


@njit(inline="always")
def _swapped(word: np.uint64) -> np.uint64:
    """Return the word with its bytes in reverse order."""
    word = (word & U(0x00FF00FF00FF00FF)) << U(8) | (word >> U(8)) & U(0x00FF00FF00FF00FF)
    word = (word & U(0x0000FFFF0000FFFF)) << U(16) | (word >> U(16)) & U(0x0000FFFF0000FFFF)
    return word << U(32) | word >> U(32)


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
    DONE(
        BUFFER,
        WORDS,
        WORDS,
        WORDS,
        WORDS,
        TABLE,
        CUBE,
        CUBE,
        types.Array(types.boolean, 1, "C"),
        types.int64,
        STAMPS,
        STAMPS,
        STAMPS,
        types.Array(types.float64, 2, "C"),
    ),
    cache=True,
    nogil=True,
)
def decode(
    buffer: Bytes,
    at: Words,
    size: Words,
    lengths: Words,
    ends: Words,
    guards: Words,
    clocks: Words,
    cells: Words,
    plain: Mask,
    number: int,
    counts: Stamps,
    which: Stamps,
    stamp: Stamps,
    values: Array,
) -> tuple[int, bool]:
    """Decode the messages whose `which` is negative by the first layout that fits.

    Return how many are left, and whether all that was decoded is finite.

    A layout k fits messages of `lengths[k]` bytes that satisfy `guards[ends[k] : ends[k + 1]]`, rows of offset, mask
    and expected word. `cells` (k, c, 4): offset, size, form, kind; `clocks` (k, 2, 4) likewise for seconds and ns,
    or (k, 0, 4). `plain` says of a layout that all of its cells are float64 in this machine's byte order, the usual
    case. Adds to the layouts' `counts`; writes a layout's number, counted from `number`, into `which`, and rows of
    `stamp` (`NO_STAMP` where there is none) and `values`.
    """
    bits = values.view(np.uint64)
    single = np.zeros(1, dtype=np.uint32)
    exponent = U(0x7FF0000000000000)
    finite = True
    left = 0
    for i in range(len(at)):
        if which[i] >= 0:
            continue
        found = -1
        for k in range(len(lengths)):
            if size[i] == lengths[k]:
                # All words of a message that is followed by eight bytes lie inside the buffer.
                inside = at[i] + size[i] + U(8) <= U(len(buffer))
                fits = True
                for g in range(ends[k], ends[k + 1]):
                    place = at[i] + guards[g, 0]
                    word = _inner_word(buffer, place) if inside else _word(buffer, place)
                    fits = word & guards[g, 1] == guards[g, 2]
                    if not fits:
                        break
                if fits:
                    found = k
                    break
        if found < 0:
            left += 1
            continue
        counts[found] += 1
        which[i] = number + found
        if clocks.shape[1] == 2:
            time = np.int64(0)
            known = True
            for c in range(2):
                part = np.int64(0)
                if clocks[found, c, 2] != ZERO:
                    word = _load(buffer, at[i] + clocks[found, c, 0], clocks[found, c, 1], clocks[found, c, 2])
                    # An unsigned 32-bit word is no negative number, and one of 64 bits beyond 2^63 no time.
                    wide = clocks[found, c, 3] == UNSIGNED and clocks[found, c, 1] < U(8)
                    part = np.int64(word) if wide else _signed(word, clocks[found, c, 1], clocks[found, c, 2])
                within = -MOST_SECONDS <= part <= MOST_SECONDS if c == 0 else 0 <= part < 1_000_000_000
                known = bool(known and within)
                time = time * 1_000_000_000 + part
            stamp[i] = time if known else NO_STAMP
        if plain[found]:
            for c in range(cells.shape[1]):
                word = _inner_word(buffer, at[i] + cells[found, c, 0])
                bits[i, c] = word
                finite &= word & exponent != exponent
            continue
        for c in range(cells.shape[1]):
            form, kind = cells[found, c, 2], cells[found, c, 3]
            if form == MISSING:
                values[i, c] = np.nan
                finite = False
                continue
            word = U(0)
            if form != ZERO:
                word = _load(buffer, at[i] + cells[found, c, 0], cells[found, c, 1], form)
            if kind == FLOAT64:
                bits[i, c] = word
            elif kind == FLOAT32:
                single[0] = word
                values[i, c] = single.view(np.float32)[0]
            elif kind == SIGNED:
                values[i, c] = _signed(word, cells[found, c, 1], form)
            elif kind == UNSIGNED:
                values[i, c] = word
            else:
                values[i, c] = np.int64(word >> U(1)) ^ -np.int64(word & U(1))
            finite &= bits[i, c] & exponent != exponent
    return left, finite
