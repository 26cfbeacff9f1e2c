"""Decompression that never produces more than a chunk declares, nor works for longer than its size allows."""

from __future__ import annotations

from collections import deque

import lz4.frame
import numpy as np
import zstandard

from kbs_process.recordings.mcap.framing import MalformedError
from kbs_process.recordings.mcap.kernels import Bytes

ALIVE = 3  # results: the one in use, one that waits, one in the making
LARGEST = 1 << 28  # bytes of one chunk, compressed or not
# The ratio keeps the work proportional to the file: sensor data reach 50, a bomb of zstd 32 000.
RATIO = 1024
ALLOWANCE = 1 << 16  # bytes that any chunk may declare


class Decompressor:
    """Decompresses chunks; the result of one holds until two more have been made."""

    def __init__(self) -> None:
        self._spaces = deque([np.zeros(0, dtype=np.uint8)] * ALIVE)
        self._zstd = zstandard.ZstdDecompressor(max_window_size=LARGEST)

    def __call__(self, compression: str, compressed: memoryview, declared: int) -> Bytes:
        """Return the `declared` bytes of a chunk.

        Raises `MalformedError` where the bytes are damaged, or are more or fewer than declared.
        """
        if declared > LARGEST or declared > ALLOWANCE + RATIO * len(compressed):
            raise MalformedError(f"{len(compressed)} bytes that declare {declared}")
        if compression == "":
            result = np.frombuffer(bytes(compressed), dtype=np.uint8)
        elif not declared and not compressed:
            result = np.zeros(0, dtype=np.uint8)
        elif compression == "zstd":
            result = self._decompress_zstd(compressed, declared)
        elif compression == "lz4":
            result = _decompress_lz4(compressed, declared)
        else:
            raise MalformedError(f"unknown compression {compression!r}")
        if len(result) != declared:
            raise MalformedError(f"{len(result)} bytes instead of the {declared} declared")
        return result

    def _decompress_zstd(self, compressed: memoryview, declared: int) -> Bytes:
        # Memory that was used before is at hand; new memory has to be cleared and mapped, page by page.
        buffer = self._spaces.popleft()
        if len(buffer) < declared:
            buffer = np.zeros(declared + declared // 4, dtype=np.uint8)
        self._spaces.append(buffer)
        target = memoryview(buffer)[:declared]  # type: ignore[arg-type]
        size = 0
        try:
            with self._zstd.stream_reader(compressed, read_across_frames=True) as reader:
                while size < declared and (step := reader.readinto(target[size:])):
                    size += step
                more = reader.read(1)
        except zstandard.ZstdError as error:
            raise MalformedError(str(error)) from error
        if more:
            raise MalformedError(f"more than the {declared} bytes declared")
        return buffer[:size]


def _decompress_lz4(compressed: memoryview, declared: int) -> Bytes:
    parts: list[bytes] = []
    size = at = 0
    while at < len(compressed):  # frames may follow one another
        context = lz4.frame.create_decompression_context()
        try:
            # One byte more than declared: a frame that has it to give is refused.
            part, used, ended = lz4.frame.decompress_chunk(context, compressed[at:], max_length=declared - size + 1)
        except RuntimeError as error:
            raise MalformedError(str(error)) from error
        if not ended or not used:
            raise MalformedError(f"the frame does not end after the {declared} bytes declared")
        parts.append(part)
        size, at = size + len(part), at + used
    return np.frombuffer(parts[0] if len(parts) == 1 else b"".join(parts), dtype=np.uint8)
