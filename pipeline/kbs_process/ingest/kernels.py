"""The compiled loops of the reader: walk a chunk's records, compare layouts, gather numbers.

Every buffer ends in `PADDING` spare bytes, so that an eight-byte word may be loaded at any byte of a message.
Positions are unsigned: numba then drops its wrap-around of negative indices, and the eight byte loads of
`_word` become one machine instruction.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Words = NDArray[np.uint64]

PADDING = 8
RECORD_HEAD = 9  # opcode, length
MESSAGE_HEAD = 22  # channel, sequence, log time, publish time
MESSAGE = 5

U = np.uint64


@njit(inline="always")
def _word(buffer: Bytes, at: np.uint64) -> np.uint64:
    """Return the little-endian 64-bit word at byte `at`."""
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


@njit("uint64[:,::1](uint8[::1], uint64, uint64)", cache=True)
def walk(buffer: Bytes, start: np.uint64, stop: np.uint64) -> Words:
    """Walk the records in buffer[start:stop]; return a row (opcode, channel, log time, at, size) for each.

    `at` and `size` are those of a message's payload, or of any other record's whole content. The last row
    has opcode 0 and, in `at`, where the walk ended: `stop`, or the first record that does not fit.
    Two passes, because a list of unknown length costs more than walking twice. Work: O(stop - start).
    """
    count = 0
    at = start
    while at + U(RECORD_HEAD) <= stop:
        length = _word(buffer, at + U(1))
        if length > stop - at - U(RECORD_HEAD) or (buffer[at] == MESSAGE and length < U(MESSAGE_HEAD)):
            break
        at += U(RECORD_HEAD) + length
        count += 1
    rows = np.zeros((count + 1, 5), dtype=np.uint64)
    rows[count, 3] = at
    at = start
    for i in range(count):
        length = _word(buffer, at + U(1))
        rows[i, 0] = buffer[at]
        at += U(RECORD_HEAD)
        rows[i, 3] = at
        rows[i, 4] = length
        if rows[i, 0] == MESSAGE:
            rows[i, 1] = U(buffer[at]) | (U(buffer[at + U(1)]) << U(8))
            rows[i, 2] = _word(buffer, at + U(6))
            rows[i, 3] = at + U(MESSAGE_HEAD)
            rows[i, 4] = length - U(MESSAGE_HEAD)
        at += length
    return rows


@njit("boolean[::1](uint8[::1], uint64[::1], uint64[::1], uint64, uint64[:,::1])", cache=True)
def matches(buffer: Bytes, at: Words, size: Words, length: np.uint64, guards: Words) -> NDArray[np.bool_]:
    """Which of the messages at `at` have `length` bytes and satisfy every guard (offset, mask, expected)."""
    result = np.zeros(len(at), dtype=np.bool_)
    for i in range(len(at)):
        if size[i] != length:
            continue
        good = True
        for g in range(len(guards)):
            if _word(buffer, at[i] + guards[g, 0]) & guards[g, 1] != guards[g, 2]:
                good = False
                break
        result[i] = good
    return result


@njit("uint64[:,::1](uint8[::1], uint64[::1], uint64[:,::1])", cache=True)
def gather(buffer: Bytes, at: Words, cells: Words) -> Words:
    """Load the cells (offset, size, form) of every message as raw bits, shape (messages, cells).

    Forms: 0 little endian, 1 big endian, 2 base-128 varint, 3 absent (zero bits).
    """
    bits = np.zeros((len(at), len(cells)), dtype=np.uint64)
    for i in range(len(at)):
        for c in range(len(cells)):
            size = cells[c, 1]
            form = cells[c, 2]
            if form == U(3):
                continue
            place = at[i] + cells[c, 0]
            if form == U(0):
                bits[i, c] = _word(buffer, place) & (~U(0) >> (U(64) - U(8) * size))
                continue
            value = U(0)
            for k in range(size):
                if form == U(1):
                    value = (value << U(8)) | U(buffer[place + U(k)])
                else:
                    value |= (U(buffer[place + U(k)]) & U(0x7F)) << (U(7) * U(k))
            bits[i, c] = value
    return bits
