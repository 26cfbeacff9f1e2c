"""What makes one kind of results a report: the type of its results.json, its head and its sections."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

from kbs_process.report.panel import Head, Panel
from kbs_process.report.tables import Tables
from kbs_process.results.records import Record, load

R = TypeVar("R", bound=Record)


@dataclass(frozen=True, slots=True)
class Document(Generic[R]):
    """A kind of report; the order of `panels` is that in which a reader meets them."""

    title: str  # of its schema
    record: type[R]
    head: Callable[[R], Head]
    panels: tuple[Callable[[R, Tables], Panel | None], ...]  # None: the section does not apply

    def read(self, folder: Path) -> tuple[Head, tuple[Panel, ...]]:
        """Return head and sections of the results in `folder`."""
        results = load(folder, self.record)
        tables = Tables(folder)
        made = (make(results, tables) for make in self.panels)
        return self.head(results), tuple(section for section in made if section is not None)
