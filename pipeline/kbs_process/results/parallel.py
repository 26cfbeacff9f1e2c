"""Independent pieces of work on all cores; results come in the order of the work, whichever ends first."""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from types import TracebackType
from typing import Any, Generic, TypeVar

Held = TypeVar("Held")
Work = TypeVar("Work")
Result = TypeVar("Result")

_held: list[Any] = []  # what this process was given, if it is one of a crew


class Crew(Generic[Held]):
    """Processes that stay from one piece of work to the next, and hold what all pieces need: it is sent to each once.

    Every piece is computed as it would be alone, so that the number of processes changes no bit of a result. They are
    started afresh: compiled code and threads do not survive being copied. One process is this one. However this process
    ends, they end with it.
    """

    def __init__(self, held: Held, processes: int | None = None) -> None:
        count = processes or len(os.sched_getaffinity(0))
        self._held = held
        self._pool: ProcessPoolExecutor | None = None
        if count > 1:
            context = multiprocessing.get_context("forkserver")
            self._pool = ProcessPoolExecutor(count, mp_context=context, initializer=_receive, initargs=(held,))

    def __enter__(self) -> Crew[Held]:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)

    def map(self, function: Callable[[Held, Work], Result], work: Sequence[Work]) -> Iterator[Result]:
        """Yield function(held, w) for every w in `work`, in order; function, w and result have to be picklable."""
        if self._pool is None:
            return (function(self._held, piece) for piece in work)
        return self._pool.map(partial(_call, function), work)


def ordered_map(
    function: Callable[[Work], Result],
    work: Sequence[Work],
    update: Callable[[float], None],
    *,
    processes: int | None = None,
) -> Iterator[Result]:
    """Yield function(w) for every w in `work`, in order, by a crew of its own."""
    count = min(processes or len(os.sched_getaffinity(0)), len(work))
    with Crew(None, max(count, 1)) as crew:
        for done, result in enumerate(crew.map(partial(_without, function), work), start=1):
            yield result
            update(done / len(work))


def _receive(held: Any) -> None:
    _held.append(held)
    threading.Thread(target=_end_with_parent, name="end with parent", daemon=True).start()


def _end_with_parent() -> None:
    """End this process when the crew's owner is gone: one that a signal kills says no goodbye."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)  # a pool's process waits for work for ever, and exit handlers would wait for it


def _call(function: Callable[[Held, Work], Result], piece: Work) -> Result:
    return function(_held[-1], piece)


def _without(function: Callable[[Work], Result], held: None, piece: Work) -> Result:
    return function(piece)
