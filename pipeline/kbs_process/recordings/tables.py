"""A foreign file seen as named columns, read in pieces: what every format offers and the importers ask for."""

from __future__ import annotations

import re
from collections import Counter
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

UNPACKED = 1100  # times the bytes stored: the best that compression makes of constants
CHUNK_ROWS = 65536
CHUNK_CELLS = 64 * CHUNK_ROWS
LONGEST_TEXT = 100  # characters of a cell: what is longer is no number, and no date
_COARSE = 0.2  # of the step of times: what they may be rounded to
_NUMBER = re.compile(r"\s*+[+-]?((\d++(\.\d*+)?|\.\d++)(e[+-]?\d++)?|inf|infinity|nan)\s*+", re.IGNORECASE | re.ASCII)


def stamps_after(start: Any, seconds: Any) -> Cells:
    """Return dates so many seconds after one, "not a time" where there are none."""
    known = np.abs(seconds) < 9e9  # False for NaN too
    ns = np.rint(np.where(known, seconds, 0.0) * 1e9).astype("timedelta64[ns]")
    return np.where(known, np.datetime64(start, "ns") + ns, np.datetime64("NaT", "ns"))


def too_coarse(times: Cells, unit: float = 1.0) -> str:
    """Say why times (n,), in units of so many s, are too coarse: floats of half size have seven digits."""
    known = times[np.isfinite(times)] if times.dtype.kind == "f" and times.dtype.itemsize < 8 else times[:0]
    if len(known) < 2:
        return ""
    early, late = np.quantile(known.astype(np.float64), (0.1, 0.9))
    step = float(late - early) / (0.8 * (len(known) - 1))
    digit = float(np.spacing(np.abs(known).max()))
    if digit <= _COARSE * step:
        return ""
    size = 8 * times.dtype.itemsize
    return f"floats of {size} bits know these times to {digit * unit:.3g} s only; rows come every {step * unit:.3g} s"


LeftOut = tuple[str, ...]  # what a file holds and no column shows, each with why


def rows_a_piece(columns: int) -> int:
    """Return how many rows of so many columns are in memory at once."""
    return min(CHUNK_ROWS, max(1, CHUNK_CELLS // max(1, columns)))


def texts(cells: Iterable[str]) -> Cells:
    """Return cells of text; one that is too long to mean anything is left empty."""
    return np.array([cell if len(cell) <= LONGEST_TEXT else "" for cell in cells], dtype=np.str_)


def number(cell: Any) -> float:
    """Return a cell of text as a number, NaN where it is none: "1_2" is, and other scripts' digits are none."""
    return float(cell) if _NUMBER.fullmatch(str(cell)) else float("nan")


@dataclass(frozen=True, slots=True)
class Column:
    """One column (channel, data set) of a source file."""

    name: str
    unit: str = ""  # as the file states it; "" where it states none
    clock: str = ""  # name of the column that carries this one's own time; "" where the format has none
    written: str = ""  # name of the column that carries when it was written, by a recorder's clock; "" where unknown


class Table(Protocol):
    """A source file opened for reading; nothing but a piece of it is ever in memory."""

    @property
    def path(self) -> Path: ...

    @property
    def columns(self) -> tuple[Column, ...]: ...

    @property
    def left_out(self) -> LeftOut: ...

    @property
    def odd(self) -> Counter[str]:
        """How often what was odd, in words, in the last pass over the file."""

    def chunks(self, names: Sequence[str]) -> Iterator[tuple[Cells, ...]]:
        """Yield the cells of the columns `names`, in the order of the file, a piece at a time."""


@dataclass(frozen=True, slots=True)
class Series:
    """One column and how to read a piece of it."""

    column: Column
    rows: int
    read: Slice


Item = Series | str | Counter[str]  # a column; something that is none, and why; or what is odd, and how often


class SeriesTable:
    """A file whose columns can be read each on its own."""

    def __init__(self, path: Path, items: Iterable[Item]) -> None:
        self.path = path
        self.odd = Counter[str]()
        self._series: dict[str, Series] = {}
        left_out, named = [], Counter[str]()
        for item in items:
            if isinstance(item, str):
                left_out.append(item)
            elif isinstance(item, Counter):
                self.odd += item
            else:
                named[item.column.name] += 1
                self._series[item.column.name] = item
        left_out += [f"{name}: {count} are called so: rename them" for name, count in named.items() if count > 1]
        self._series = {name: one for name, one in self._series.items() if named[name] == 1}
        self.columns = tuple(one.column for one in self._series.values())
        self.left_out = tuple(left_out)

    def chunks(self, names: Sequence[str]) -> Iterator[tuple[Cells, ...]]:
        """Yield equal stretches of several columns; the shorter ones run out first."""
        series = [self._series[name] for name in names]
        rows = rows_a_piece(len(names))
        for first in range(0, max((one.rows for one in series), default=0), rows):
            yield tuple(one.read(first, rows) for one in series)


def series_of(data: Any, name: str, unit: str = "", change: Callable[[Cells], Cells] | None = None) -> Iterator[Item]:
    """Yield the columns of an array of numbers, in memory or in a file: `name`, or "name[1]", "name[2]"... of a matrix.

    The longer side of a matrix is time (MATLAB's HDF5 files have theirs transposed); other arrays have no columns.
    `change` makes numbers of what is stored.
    """
    if data.dtype.kind not in "iufbM":
        yield f"{name or 'the array'}: it holds {_KINDS.get(data.dtype.kind, 'no numbers')}"
    elif data.ndim == 1:
        yield Series(Column(name or "[1]", unit), len(data), _changed(lambda rows: data[rows], change))
    elif data.ndim == 2:
        yield from matrix_of(data, name, unit, change, upright=data.shape[0] >= data.shape[1])
    else:
        yield f"{name or 'the array'}: it has {data.ndim} dimensions, where columns have one, and matrices two"


_KINDS = {"c": "complex numbers", "S": "text", "U": "text", "O": "objects", "V": "records", "m": "durations"}


def matrix_of(
    data: Any, name: str, unit: str = "", change: Callable[[Cells], Cells] | None = None, *, upright: bool
) -> Iterator[Item]:
    """Yield the columns of a matrix, which are its rows where it is not `upright`."""
    if data.dtype.kind not in "iufbM":
        yield f"{name or 'the array'}: it holds {_KINDS.get(data.dtype.kind, 'no numbers')}"
        return
    rows, width = data.shape if upright else data.shape[::-1]
    for index in range(width):
        label = name if name and width == 1 else f"{name}[{index + 1}]"
        yield Series(Column(label, unit), rows, _changed(_line_of(data, index, upright), change))


def _line_of(data: Any, index: int, upright: bool) -> Callable[[slice], Any]:
    return lambda rows: data[(rows, index) if upright else (index, rows)]


def _changed(read: Callable[[slice], Any], change: Callable[[Cells], Cells] | None) -> Slice:
    if change is None:
        return lambda first, count: np.asarray(read(slice(first, first + count)))
    return lambda first, count: change(np.asarray(read(slice(first, first + count))))


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
        start = f"{wanted.partition('[')[0]}: "
        if why := next((one for one in table.left_out if one.startswith(start)), ""):
            raise RecordingError(f"no column '{wanted}'; {why}", where=str(table.path), remedy="write the file anew")
        raise RecordingError(
            f"no column '{wanted}'",
            where=str(table.path),
            remedy=f"the file has one column, '{columns[0].name}': set the delimiter ([text] delimiter)"
            if single
            else did_you_mean(wanted, named),
        )
    return named[wanted]
