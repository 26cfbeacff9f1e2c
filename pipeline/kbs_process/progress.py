"""How long work tells a user how far it is."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from time import monotonic
from typing import Protocol, TextIO

from kbs_process import interruption
from kbs_process.terminal import printable


class Task(Protocol):
    """One piece of work under way."""

    def update(self, fraction: float) -> None:
        """Say which fraction, 0 to 1, is done."""


class Progress(Protocol):
    """Where work reports itself."""

    def task(self, label: str) -> AbstractContextManager[Task]:
        """Open a task; it ends, done or failed, with the context."""


@dataclass(frozen=True, slots=True)
class _Task:
    show: Callable[[float], object]

    def update(self, fraction: float) -> None:
        interruption.check()
        self.show(fraction)


class SilentProgress:
    """Says nothing."""

    @contextmanager
    def task(self, label: str) -> Iterator[Task]:
        yield _Task(lambda fraction: None)


@dataclass(slots=True)
class PlainProgress:
    """One line a task, for logs."""

    stream: TextIO = field(default_factory=lambda: sys.stderr)

    @contextmanager
    def task(self, label: str) -> Iterator[Task]:
        print(printable(label), file=self.stream, flush=True)
        yield _Task(lambda fraction: None)


class TerminalProgress:
    """Bars on stderr while tasks run, one line for each when it is done; tasks may be nested."""

    def __init__(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
        from rich.progress import Progress as Bars

        columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
        self._console = Console(stderr=True)
        self._bars = Bars(*columns, console=self._console, transient=True)
        self._depth = 0

    @contextmanager
    def task(self, label: str) -> Iterator[Task]:
        from rich.markup import escape

        label = escape(printable(label))
        bar = self._bars.add_task("  " * self._depth + label, total=1.0)
        begin = monotonic()
        if self._depth == 0:
            self._bars.start()
        self._depth += 1
        try:
            yield _Task(lambda fraction: self._bars.update(bar, completed=fraction))
            if self._depth == 1:
                self._console.print(f"{label}  [dim]{monotonic() - begin:.1f} s[/dim]", highlight=False)
        finally:
            self._depth -= 1
            self._bars.remove_task(bar)
            if self._depth == 0:
                self._bars.stop()


def progress_for_terminal() -> Progress:
    """Return bars if stderr is a terminal, plain lines otherwise."""
    return TerminalProgress() if sys.stderr.isatty() else PlainProgress()
