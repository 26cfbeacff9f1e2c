"""Independent pieces of work on all cores; results come in the order of the work, whichever ends first."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import TypeVar

Work = TypeVar("Work")
Result = TypeVar("Result")


def ordered_map(
    function: Callable[[Work], Result],
    work: Sequence[Work],
    update: Callable[[float], None],
    *,
    processes: int | None = None,
) -> Iterator[Result]:
    """Yield function(w) for every w in `work`, in order; both have to be picklable.

    Every piece is computed as it would be alone, so that the number of processes changes no bit of a result. New
    processes are started afresh: compiled code and threads do not survive being copied.
    """
    count = min(processes or len(os.sched_getaffinity(0)), len(work))
    if count <= 1:
        for done, piece in enumerate(work, start=1):
            yield function(piece)
            update(done / len(work))
        return
    context = multiprocessing.get_context("forkserver")
    with ProcessPoolExecutor(count, mp_context=context) as pool:
        for done, result in enumerate(pool.map(function, work), start=1):
            yield result
            update(done / len(work))
