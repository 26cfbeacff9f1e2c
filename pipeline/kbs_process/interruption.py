"""An interrupt that is not lost.

Python raises KeyboardInterrupt wherever it happens to be. In a callback of foreign code, as a compiler's while it loads
machine code, nobody passes it on, and the foreign code goes on with half an answer. So an interrupt is remembered, and
raised at the next check; at once, too, outside the compiler.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

COMPILER = "llvmlite"
"""The package whose callbacks have to end."""

_asked = threading.Event()


@contextmanager
def heeded() -> Iterator[None]:
    """Remember interrupts while the block runs; only the main thread gets any."""
    _asked.clear()
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, _remember)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def check() -> None:
    """Raise KeyboardInterrupt if there has been an interrupt."""
    if _asked.is_set():
        raise KeyboardInterrupt


def _remember(number: int, frame: FrameType | None) -> None:
    _asked.set()
    while frame is not None:
        if frame.f_globals.get("__name__", "").partition(".")[0] == COMPILER:
            return
        frame = frame.f_back
    raise KeyboardInterrupt
