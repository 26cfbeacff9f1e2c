"""Delimited text: CSV, TSV, and what data acquisition programs call TXT."""

from __future__ import annotations

import csv
import itertools
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from kbs_process.errors import RecordingError
from kbs_process.recordings.formats import Format, Text
from kbs_process.recordings.tables import CHUNK_ROWS, Cells, Column

if TYPE_CHECKING:
    import pandas as pd

DELIMITERS = "\t;,|"
_HEAD_LINES = 32
_DATE = re.compile(r"\d{4}-\d\d-\d\d([T ]\d\d:\d\d.*)?")


class TextTable:
    """A delimited text file; pandas parses numbers to the nearest double (before 3.1 it did not)."""

    def __init__(self, path: Path, options: Text) -> None:
        self.path = path
        self._options = options
        numbered = self._head()
        head = [line for _, line in numbered]
        self._delimiter = options.delimiter or sniff_delimiter(head, options.decimal)
        cells = [_split(line, self._delimiter) for line in head]
        named = not all(map(self._is_number, cells[0])) if options.header is None else options.header
        # What is read later counts every line of the file, comments and blank ones too.
        told = named + options.units_row
        self._first_data_row = numbered[told][0] if told < len(numbered) else numbered[-1][0] + 1
        # Rows may end with a delimiter where the line of names does not.
        width = max(len(cells[0]), len(cells[min(named + options.units_row, len(cells) - 1)]))
        names = _unique(_widened(cells[0] if named else [], width))
        units = _widened(cells[named] if options.units_row and len(cells) > named else [], width)
        self.columns = tuple(Column(name, unit.strip("()[] ")) for name, unit in zip(names, units, strict=True))

    def chunks(self, names: Sequence[str]) -> Iterator[tuple[Cells, ...]]:
        import pandas as pd

        every = [column.name for column in self.columns]
        try:
            with pd.read_csv(
                self.path,
                sep=self._delimiter if self._delimiter != " " else r"\s+",
                header=None,
                names=every,  # all are parsed: with `usecols`, surplus cells would be dropped without a word
                index_col=False,
                skiprows=self._first_data_row,
                chunksize=CHUNK_ROWS,
                decimal=self._options.decimal,
                comment=self._options.comment,
                encoding=self._options.encoding,
                skipinitialspace=True,
            ) as reader:
                for frame in reader:
                    yield tuple(_cells(frame[name], self._options.decimal) for name in names)
        except pd.errors.EmptyDataError:
            return
        except (pd.errors.ParserError, UnicodeDecodeError) as error:
            raise RecordingError(
                f"not a table of {len(every)} columns: {error}",
                where=str(self.path),
                remedy="check delimiter, skip_rows and encoding in the mapping's [text]",
            ) from error

    def _head(self) -> list[tuple[int, str]]:
        """Return the first lines that hold data or names, with their places in the file."""
        comment = self._options.comment
        try:
            with self.path.open(encoding=self._options.encoding, newline=None) as file:
                lines = itertools.islice(enumerate(file), self._options.skip_rows, None)
                bounded = ((place, line.rstrip("\n")[:1_000_000]) for place, line in lines)
                kept = (
                    (place, line)
                    for place, line in bounded
                    if line.strip() and not (comment and line.startswith(comment))
                )
                head = list(itertools.islice(kept, _HEAD_LINES))
        except (UnicodeDecodeError, LookupError) as error:
            raise RecordingError(
                f"not text in {self._options.encoding}: {error}",
                where=str(self.path),
                remedy="set encoding in the mapping's [text], or format where the file is no text at all",
            ) from error
        if not head:
            raise RecordingError("the file is empty", where=str(self.path))
        return head

    def _is_number(self, cell: str) -> bool:
        """Whether a cell is no name: a number, a date, or nothing."""
        if not cell or _DATE.fullmatch(cell):
            return True
        try:
            float(cell.replace(self._options.decimal, "."))
        except ValueError:
            return False
        return True


def sniff_delimiter(lines: Sequence[str], decimal: str = ".") -> str:
    """Return the delimiter that splits all `lines` into most columns; "," where none does, " " for blanks.

    The `decimal` mark splits numbers, and no columns.
    """
    able = DELIMITERS.replace(decimal, "")
    best = max(able, key=lambda delimiter: min(line.count(delimiter) for line in lines))
    if min(line.count(best) for line in lines):
        return best
    return " " if min(len(line.split()) for line in lines) > 1 else able.strip("\t|")[-1]


def _split(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        cells = line.split()
    else:
        try:
            cells = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))
        except csv.Error:  # no line of a table
            cells = line.split(delimiter)
    return [cell.strip().strip('"') for cell in cells]


def _widened(cells: Sequence[str], width: int) -> list[str]:
    return [*cells, *[""] * (width - len(cells))]


def _unique(names: Sequence[str]) -> tuple[str, ...]:
    """Return `names` with " (2)", " (3)"... added to those that come again, and a number to those left empty."""
    seen: dict[str, int] = {}
    unique = []
    for position, name in enumerate(names, start=1):
        name = name or str(position)
        seen[name] = seen.get(name, 0) + 1
        unique.append(name if seen[name] == 1 else f"{name} ({seen[name]})")
    return tuple(unique)


def _cells(series: pd.Series[float], decimal: str) -> Cells:
    """Return a parsed column as numbers where pandas found nothing else in this piece, else as text with points."""
    if series.dtype.kind in "iuf":
        return series.to_numpy()
    cells = zip(series, series.isna(), strict=True)
    return np.array(["" if absent else str(cell).replace(decimal, ".") for cell, absent in cells], dtype=np.str_)


FORMAT = Format(suffixes=(".csv", ".tsv", ".txt", ".dat", ".asc"), read=TextTable, isolated=False)
