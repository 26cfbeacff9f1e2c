"""Independent pieces of work, on the cores of this machine or on a Dask cluster; one way for all that is spread.

Every piece is computed as it would be alone, so that neither their number nor the place changes a bit of a result.
"""

from __future__ import annotations

import itertools
import multiprocessing
import os
import subprocess
import sys
import threading
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from contextlib import ExitStack, contextmanager
from types import TracebackType
from typing import Any, Generic, TypeVar

import kbs_process
from kbs_process.errors import ConfigError
from kbs_process.results.code import content

Held = TypeVar("Held")
Work = TypeVar("Work")
Result = TypeVar("Result")

PATIENCE = 10.0  # s, for a scheduler to answer
_IN_FLIGHT = 64  # pieces that are held at a time, where it does not matter which is done first
_held: list[Any] = []  # what this process was given, if it is one of a crew


@contextmanager
def workers(processes: int | None = None, scheduler: str | None = None, *, held: object = None) -> Iterator[Executor]:
    """Yield what does pieces of work: processes of this machine, or a Dask cluster by its scheduler's address.

    Processes are started afresh, and are given `held`: compiled code and threads do not survive being copied. However
    this process ends, they end with it. Work on a cluster travels as bytes, and needs no shared files; what a worker
    had when it died is done by another.
    """
    if scheduler is None:
        count = processes or len(os.sched_getaffinity(0))
        context = multiprocessing.get_context("forkserver")
        pool = ProcessPoolExecutor(count, mp_context=context, initializer=_receive, initargs=(held,))
        try:
            yield pool
        finally:
            pool.shutdown(cancel_futures=True)
        return
    with _client(scheduler) as client:
        there = client.get_executor(pure=False)
        try:
            yield there
        finally:
            there.shutdown(wait=False)  # nobody waits for what is left


@contextmanager
def _client(scheduler: str) -> Iterator[Any]:
    try:
        from distributed import Client
    except ImportError:
        raise ConfigError(
            "a Dask cluster needs the package distributed", remedy='pip install "kbs-process[cluster]"'
        ) from None
    try:
        client: Any = Client(scheduler, timeout=PATIENCE)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise ConfigError(
            f"no Dask scheduler answers: {error}", where=scheduler, remedy="start one with: dask scheduler"
        ) from None
    with client:
        try:
            others = [worker for worker, has in client.run(content).items() if has != content()]
        except (ImportError, AttributeError) as error:
            raise ConfigError(
                f"its workers cannot do this: {error}", where=scheduler, remedy="install there what is installed here"
            ) from None
        if others:
            raise ConfigError(
                f"other versions of kbs-process are on its workers {', '.join(others)}",
                where=scheduler,
                remedy="install there what is installed here",
            )
        yield client


def each(pool: Executor, function: Callable[[Work], Result], work: Iterable[Work]) -> Iterator[tuple[Work, Result]]:
    """Yield each piece of work with its result as it is done; few are held at a time."""
    waiting = iter(work)
    pending: dict[Future[Result], Work] = {}
    while True:
        for piece in itertools.islice(waiting, _IN_FLIGHT - len(pending)):
            pending[pool.submit(function, piece)] = piece
        if not pending:
            return
        for future in wait(pending, return_when=FIRST_COMPLETED).done:
            yield pending.pop(future), future.result()


def run(words: Sequence[str]) -> tuple[int, str, str]:
    """Run a command of this program in a process of its own; return its exit status, its output and its complaints."""
    command = [sys.executable, "-P", "-m", kbs_process.__name__, *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout, done.stderr


class Crew(Generic[Held]):
    """Workers that stay from one piece of work to the next, and hold what all pieces need: it is sent to each once.

    Where there is but one process, it is this one.
    """

    def __init__(self, held: Held, processes: int | None = None, scheduler: str | None = None) -> None:
        self._held = held
        self._stack = ExitStack()
        self._submit: Callable[..., Future[Any]] | None = None
        if scheduler is not None:
            pool = self._stack.enter_context(workers(scheduler=scheduler))
            self._submit = _holding(pool, held)
        elif (processes or len(os.sched_getaffinity(0))) > 1:
            pool = self._stack.enter_context(workers(processes, held=held))
            self._submit = lambda function, piece: pool.submit(_call, function, piece)

    def __enter__(self) -> Crew[Held]:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.__exit__(kind, error, trace)

    def map(self, function: Callable[[Held, Work], Result], work: Sequence[Work]) -> Iterator[Result]:
        """Yield function(held, w) for every w in `work`, in order; function, w and result have to be picklable."""
        if self._submit is None:
            return (function(self._held, piece) for piece in work)
        return _in_order([self._submit(function, piece) for piece in work])


def ordered_map(
    function: Callable[[Work], Result],
    work: Sequence[Work],
    update: Callable[[float], None],
    *,
    processes: int | None = None,
    scheduler: str | None = None,
) -> Iterator[Result]:
    """Yield function(w) for every w in `work`, in order, by a crew of its own."""
    count = min(processes or len(os.sched_getaffinity(0)), len(work))
    with Crew(function, max(count, 1), scheduler) as crew:
        for done, result in enumerate(crew.map(_apply, work), start=1):
            yield result
            update(done / len(work))


def _holding(pool: Any, held: object) -> Callable[..., Future[Any]]:
    """Return what submits work to a cluster, where `held` is a result, too: lost with a worker, it comes again."""
    client = pool._client
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # recordings are large
        there = client.submit(_itself, held, pure=False)
    return lambda function, piece: pool.submit(function, there, piece)


def _itself(held: Held) -> Held:
    return held


def _apply(function: Callable[[Work], Result], piece: Work) -> Result:
    return function(piece)


def _in_order(futures: Sequence[Future[Result]]) -> Iterator[Result]:
    try:
        for future in futures:
            yield future.result()
    finally:
        for future in futures:
            future.cancel()


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
