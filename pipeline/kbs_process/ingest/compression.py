"""Decompression that never produces more than a chunk declares, nor works for longer than its size allows."""

from __future__ import annotations

import lz4.frame
import numpy as np
import zstandard

from kbs_process.ingest.framing import MalformedError
from kbs_process.ingest.kernels import PADDING, Bytes

LARGEST = 1 << 28  # bytes of one chunk, compressed or not
# The ratio keeps the work proportional to the file: sensor data reach 50, a bomb of zstd 32 000.
RATIO = 1024
ALLOWANCE = 1 << 16  # bytes that any chunk may declare


class Decompressor:
    """Decompresses chunks into one buffer, used again for each; its content holds until the next call."""

    def __init__(self) -> None:
        self._buffer = np.zeros(PADDING, dtype=np.uint8)
        self._zstd = zstandard.ZstdDecompressor(max_window_size=LARGEST)

    def buffer(self, size: int) -> Bytes:
        """Return a buffer of at least `size` bytes and the padding."""
        if len(self._buffer) < size + PADDING:
            self._buffer = np.zeros(size + size // 4 + PADDING, dtype=np.uint8)
        return self._buffer

    def __call__(self, compression: str, compressed: memoryview, declared: int) -> Bytes:
        """Return a buffer whose first `declared` bytes are the decompressed chunk.

        Raises `MalformedError` where the bytes are damaged, or are more or fewer than declared.
        """
        if declared > LARGEST or declared > ALLOWANCE + RATIO * len(compressed):
            raise MalformedError(f"{len(compressed)} bytes that declare {declared}")
        buffer = self.buffer(declared)
        target = memoryview(buffer)[:declared]  # type: ignore[arg-type]
        if compression == "zstd":
            self._decompress_zstd(compressed, target)
        elif compression == "lz4":
            target[:] = _decompress_lz4(compressed, declared)
        elif compression == "":
            if len(compressed) != declared:
                raise MalformedError(f"{len(compressed)} bytes instead of the {declared} declared")
            target[:] = compressed
        else:
            raise MalformedError(f"unknown compression {compression!r}")
        return buffer

    def _decompress_zstd(self, compressed: memoryview, target: memoryview) -> None:
        if not target and not compressed:
            return
        try:
            with self._zstd.stream_reader(compressed, read_across_frames=True) as reader:
                size = 0
                while size < len(target) and (step := reader.readinto(target[size:])):
                    size += step
                more = reader.read(1)
        except zstandard.ZstdError as error:
            raise MalformedError(str(error)) from error
        if size != len(target) or more:
            raise MalformedError(f"{'more' if more else 'fewer'} bytes than the {len(target)} declared")


def _decompress_lz4(compressed: memoryview, declared: int) -> bytes:
    if not declared and not compressed:
        return b""
    decompressor = lz4.frame.LZ4FrameDecompressor()
    try:
        # One byte more than declared: a frame that has it to give is refused.
        result: bytes = decompressor.decompress(compressed, max_length=declared + 1)
    except (RuntimeError, EOFError) as error:
        raise MalformedError(str(error)) from error
    if len(result) != declared or not decompressor.eof or decompressor.unused_data:
        raise MalformedError(f"the frame does not end after the {declared} bytes declared")
    return result
