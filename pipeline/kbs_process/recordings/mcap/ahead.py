"""The next item made in the background while the one before is in use."""

from __future__ import annotations

from collections.abc import Generator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")


def ahead(items: Generator[T]) -> Generator[T]:
    """Yield `items`, the next of which is being made by one thread; close them where the caller stops early.

    The order, and any exception, are those of `items` themselves. At most three of them are alive: the caller's,
    one that waits and one in the making. It pays where making them leaves the interpreter free, as reading,
    decompressing and checking do.
    """
    with ThreadPoolExecutor(1) as pool:
        try:
            pending = pool.submit(next, items, None)
            while (item := pending.result()) is not None:
                pending = pool.submit(next, items, None)
                yield item
        finally:
            pool.shutdown()
            items.close()
