"""The compiled loops of the reader: walk a buffer's records, decode messages that are laid out alike.

Positions are unsigned: numba then drops its wrap-around of negative indices, and the eight byte loads of
`_word` become one machine instruction. Whoever calls has checked that messages lie inside the buffer and
cells inside the messages.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types
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


@njit(inline="always")
def _inner_word(buffer: Bytes, at: np.uint64) -> np.uint64:
    """Return the little-endian 64-bit word at byte `at`; all of it must lie inside the buffer."""
    return (
        U(buffer[at])
        | (U(buffer[at + U(1)]) << U(8))
        | (U(buffer[at + U(2)]) << U(16))
        | (U(buffer[at + U(3)]) << U(24))
        | (U(buffer[at + U(4)]) << U(32))
        | (U(buffer[at + U(5)]) << U(40))
        | (U(buffer[at + U(6)]) << U(48))
        | (U(buffer[at + U(7)]) << U(56))
    )


@njit(inline="always")
def _word(buffer: Bytes, at: np.uint64) -> np.uint64:
    """Return the little-endian 64-bit word at byte `at`, zeros beyond the buffer's end."""
    if at + U(8) <= U(len(buffer)):
        return _inner_word(buffer, at)
    word = U(0)
    for k in range(U(len(buffer)) - at if at < U(len(buffer)) else U(0)):
        word |= U(buffer[at + U(k)]) << U(8 * k)
    return word


@njit(TABLE(BUFFER, types.uint64, types.boolean), cache=True)
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
def _load(buffer: Bytes, place: np.uint64, size: np.uint64, form: np.uint64) -> np.uint64:
    """Return the bits of a cell of `size` bytes."""
    if form == LITTLE:
        return _word(buffer, place) & (~U(0) >> (U(64) - U(8) * size))
    bits = U(0)
    for k in range(size):
        byte = U(buffer[place + U(k)])
        if form == BIG:
            bits = (bits << U(8)) | byte
        else:
            bits |= (byte & U(0x7F)) << (U(7) * U(k))
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
        inside = at[i] + length + U(8) <= U(len(buffer))  # no word of a guard reaches beyond the buffer
        for g in range(len(guards)):
            place = at[i] + guards[g, 0]
            word = _inner_word(buffer, place) if inside else _word(buffer, place)
            fits = word & guards[g, 1] == guards[g, 2]
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
