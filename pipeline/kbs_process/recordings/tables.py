"""A foreign file seen as named columns, read in pieces: what every format offers and the importers ask for."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from kbs_process.errors import RecordingError, did_you_mean

Cells = NDArray[Any]  # one column's cells as the file has them: numbers, datetime64 or text
# Cells first .. first + count of one column; fewer at its end, none beyond.
Slice = Callable[[int, int], Cells]

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


@dataclass(frozen=True, slots=True)
class Series:
    """One column and how to read a piece of it."""

    column: Column
    rows: int
    read: Slice


class SeriesTable:
    """A file whose columns can be read each on its own."""

    def __init__(self, path: Path, series: Iterable[Series]) -> None:
        self.path = path
        self._series = {one.column.name: one for one in series}
        self.columns = tuple(one.column for one in self._series.values())

    def chunks(self, names: Sequence[str]) -> Iterator[tuple[Cells, ...]]:
        """Yield equal stretches of several columns; the shorter ones run out first."""
        series = [self._series[name] for name in names]
        for first in range(0, max((one.rows for one in series), default=0), CHUNK_ROWS):
            yield tuple(one.read(first, CHUNK_ROWS) for one in series)


def rows_of(data: Any) -> Slice:
    """Return how to read an array of one dimension, in memory or in a file."""
    return lambda first, count: np.asarray(data[first : first + count])


def series_of(data: Any, name: str, unit: str = "") -> Iterator[Series]:
    """Yield the columns of an array of numbers, in memory or in a file: `name`, or "name[1]", "name[2]"... of a matrix.

    The longer side of a matrix is time (MATLAB's HDF5 files have theirs transposed); other arrays have no columns.
    """
    if data.dtype.kind not in "iufb" or data.ndim not in (1, 2):
        return
    if data.ndim == 1:
        yield Series(Column(name or "[1]", unit), len(data), rows_of(data))
        return
    upright = data.shape[0] >= data.shape[1]
    rows, width = data.shape if upright else data.shape[::-1]
    for index in range(width):
        label = name if name and width == 1 else f"{name}[{index + 1}]"
        yield Series(Column(label, unit), rows, _line_of(data, index, upright))


def _line_of(data: Any, index: int, upright: bool) -> Slice:
    if upright:
        return lambda first, count: np.asarray(data[first : first + count, index])
    return lambda first, count: np.asarray(data[index, first : first + count])


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
