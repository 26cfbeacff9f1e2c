"""Reading ahead changes nothing but when the work is done."""

from __future__ import annotations

import threading
from collections.abc import Generator

import pytest

from kbs_process.recordings.mcap.ahead import ahead


def counted(limit: int, made: list[int], error: Exception | None = None) -> Generator[int]:
    """Yield 0 .. limit - 1, note each, then raise `error`; -1 is noted when it is closed."""
    try:
        for i in range(limit):
            made.append(i)
            yield i
        if error is not None:
            raise error
    finally:
        made.append(-1)


def test_order_is_kept_and_the_end_found() -> None:
    made: list[int] = []
    assert list(ahead(counted(100, made))) == list(range(100))
    assert made == [*range(100), -1]


def test_an_error_comes_where_it_belongs() -> None:
    got = []
    with pytest.raises(ValueError, match="damaged"):
        for item in ahead(counted(3, [], ValueError("damaged"))):
            got.append(item)
    assert got == [0, 1, 2]


def test_at_most_one_item_waits_and_stopping_early_leaves_nothing_behind() -> None:
    made: list[int] = []
    threads = threading.active_count()
    items = ahead(counted(100, made))
    assert next(items) == 0
    items.close()
    assert made in ([0, 1, -1], [0, -1])
    assert threading.active_count() == threads
