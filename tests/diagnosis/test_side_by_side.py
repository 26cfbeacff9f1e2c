"""Work in threads comes back in order, with its errors, and does not hold up who gives up."""

from __future__ import annotations

import threading
import time

import pytest

from kbs_process.diagnosis.side_by_side import MOST, side_by_side


def test_results_come_in_the_order_of_the_items() -> None:
    assert side_by_side(lambda k: (time.sleep(0.02 * (3 - k)), k)[1], range(4)) == [0, 1, 2, 3]


def test_an_error_is_raised_at_once_and_what_was_not_begun_is_not_done() -> None:
    done: list[int] = []
    free, threads = threading.Event(), set[threading.Thread]()

    def work(k: int) -> None:
        threads.add(threading.current_thread())
        if k == 0:
            raise ValueError("no such luck")
        free.wait(10.0)
        done.append(k)

    begun = time.monotonic()
    with pytest.raises(ValueError, match="no such luck"):
        side_by_side(work, range(64))
    assert time.monotonic() - begun < 5.0
    free.set()
    for thread in threads:
        thread.join(10.0)
    assert len(done) <= MOST
