"""CRC-32 (IEEE 802.3), at memory speed where the processor's carry-less multiplication is at hand.

zlib's own costs as much as half of the decompression of the same bytes; isal's a tenth of that.
"""

from __future__ import annotations

try:
    from isal.isal_zlib import crc32
except ImportError:  # no build for this processor
    from zlib import crc32

__all__ = ["crc32"]
