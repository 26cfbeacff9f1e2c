"""A source file seen as named columns, read in pieces: what every reader offers and the importers ask for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from numpy.typing import NDArray

from kbs_process.errors import RecordingError, did_you_mean

Cells = NDArray[Any]  # one column's cells as the file has them: numbers, datetime64 or text

CHUNK_ROWS = 65536


@dataclass(frozen=True, slots=True)
class Column:
    """One column (channel, data set) of a source file."""

    name: str
    unit: str = ""  # as the file states it; "" where it states none
    clock: str = ""  # name of the column that carries this one's own time; "" where the format has none


class Table(Protocol):
    """A source file opened for reading; nothing but a piece of it is ever in memory."""

    @property
    def path(self) -> Path: ...

    @property
    def columns(self) -> tuple[Column, ...]: ...

    def chunks(self, names: Sequence[str]) -> Iterator[tuple[Cells, ...]]:
        """Yield the cells of the columns `names`, in the order of the file, at most CHUNK_ROWS at a time."""


def find_column(table: Table, wanted: int | str) -> Column:
    """Return the column called `wanted`, or at that 1-based position."""
    columns = table.columns
    if isinstance(wanted, int):
        if not 1 <= wanted <= len(columns):
            raise RecordingError(
                f"no column {wanted}: the file has {len(columns)}",
                where=str(table.path),
                remedy="columns are counted from 1; check the delimiter where the count looks wrong",
            )
        return columns[wanted - 1]
    named = {column.name: column for column in columns}
    if wanted not in named:
        single = len(columns) == 1
        raise RecordingError(
            f"no column '{wanted}'",
            where=str(table.path),
            remedy=f"the file has one column, '{columns[0].name}': set the delimiter ([text] delimiter)"
            if single
            else did_you_mean(wanted, named),
        )
    return named[wanted]
