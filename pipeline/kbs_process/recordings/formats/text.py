"""Delimited text: CSV, TSV, and what data acquisition programs call TXT."""

from __future__ import annotations

import csv
import io
import itertools
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from kbs_process.errors import RecordingError
from kbs_process.recordings.formats import Format, Text
from kbs_process.recordings.tables import Cells, Column, LeftOut, number, rows_a_piece, texts

if TYPE_CHECKING:
    import pandas as pd

DELIMITERS = "\t;,|"
_HEAD_LINES = 32
_SHOWN = 60  # characters of a line
_LONGEST_LINE = 1 << 24  # characters
_DATE = re.compile(r"\d{4}-\d\d-\d\d([T ]\d\d:\d\d.*)?")
_UTF16 = (b"\xff\xfe", b"\xfe\xff")


class TextTable:
    """A delimited text file; pandas parses numbers to the nearest double (before 3.1 it did not).

    A line with more or fewer cells than the table has columns is no row of it: nobody knows which cell is missing.
    """

    def __init__(self, path: Path, options: Text) -> None:
        self.path = path
        self.left_out: LeftOut = ()
        self.odd = Counter[str]()
        self._options = options
        if options.thousands == options.decimal:
            remedy = "give one of decimal and thousands in the mapping's [text] another sign"
            raise RecordingError(f"'{options.decimal}' cannot part thousands too", where=str(path), remedy=remedy)
        with path.open("rb") as file:
            wide = file.read(2) in _UTF16 and options.encoding == Text().encoding
        self._encoding = "utf-16" if wide else options.encoding
        head = list(itertools.islice(self._lines(options.skip_rows), _HEAD_LINES))
        if not head:
            raise RecordingError("the file is empty", where=str(path))
        self._delimiter = options.delimiter or sniff_delimiter([line for _, line in head], options.decimal)
        cells = [_split(line, self._delimiter) for _, line in head]
        named = not all(map(self._is_number, cells[0])) if options.header is None else options.header
        # What is read later counts every line of the file, comments and blank ones too.
        usual = Counter(map(len, cells[named:] or cells)).most_common(1)[0][0]
        table = [(place, row) for (place, _), row in zip(head, cells, strict=True)][named:]
        if usual == len(cells[0]):  # then lines of other widths are no rows
            table = [(place, row) for place, row in table if len(row) == usual]
        if len(head) < 2 or len(table) <= options.units_row:
            raise RecordingError(
                f"line {head[-1][0] + 1} is the last one, and no table is there: it has a row a line, below the names",
                where=str(path),
                remedy="export it again; " + _NO_TEXT,
            )
        self._first_data_row = table[0][0] + 1 if options.units_row else head[named][0]
        rows = [row for _, row in table[options.units_row :]]
        first, second = ([cell for cell in row if cell] for row in (*rows, [], [])[:2])
        if named and first and any(map(self._is_number, second)) and not any(map(self._is_number, first)):
            raise RecordingError(
                f"line {table[options.units_row][0] + 1} holds no number: {', '.join(first)[:_SHOWN]}",
                where=str(path),
                remedy="write units_row = true in the mapping's [text] if these are units; else take the line out",
            )
        self._names = head[0][1] if named else ""  # as a later section of a log repeats it
        self._units = dict(head)[table[0][0]] if options.units_row else ""
        units = table[0][1] if options.units_row else []
        names = self._fitted(cells[0], rows) if named else [""] * usual
        units = (units + [""] * len(names))[: len(names)]
        self.columns = tuple(
            Column(name, unit.strip("()[] ")) for name, unit in zip(_unique(names), units, strict=True)
        )

    def chunks(self, names: Sequence[str]) -> Iterator[tuple[Cells, ...]]:
        self.odd.clear()
        every = [column.name for column in self.columns]
        lines = self._rows(len(every))
        while piece := list(itertools.islice(lines, rows_a_piece(len(every)))):
            frame = self._parsed(piece, every)
            yield tuple(self._cells(frame[name]) for name in names)

    def sections(self) -> int:
        """Return how many sections there are, each below the line of names."""
        return 1 + sum(line == self._names for _, line in self._lines(self._first_data_row))

    def _rows(self, width: int) -> Iterator[str]:
        """Yield the lines that are rows of the table, and count those that are none; most are, or it is another."""
        delimiter, kept, out = self._delimiter, 0, 0
        left = self._options.rows
        wanted, section = self._options.section, 1
        for place, line in self._lines(self._first_data_row):
            section += line == self._names
            if line in (self._names, self._units) or section != (wanted or section):
                continue
            if '"' in line or delimiter == " ":
                count = len(_split(line, delimiter)) if line.count('"') % 2 == 0 else 0
            else:
                count = line.count(delimiter) + 1
            if count > width:  # rows may end with delimiters where the line of names does not
                line, count = _without_empty_end(line, delimiter, count - width), width
            if count != width or line == "" or "\0" in line:
                first = f"lines are no rows of {width} cells, left out (the first is line {place + 1})"
                known = next((what for what in self.odd if what.startswith("lines are no rows")), first)
                self.odd[known] = out = out + 1
                continue
            if left is not None:
                if not left:
                    return
                left -= 1
            kept += 1
            yield line
        if section < (wanted or 1):
            what = f"there is no section {wanted}: its line of names is there {section} times"
            raise RecordingError(what, where=str(self.path), remedy="correct `section` in the mapping's [[recording]]")
        if section > 1 and not wanted:
            again = "sections follow, below the names again: give each a [[recording]] with section = 1, 2, ..."
            self.odd[again] = section - 1
        if out > kept:
            raise RecordingError(
                f"{out} of {out + kept} {known.replace(', left out', '')}",
                where=str(self.path),
                remedy="say where the table begins and ends: skip_rows and rows in the mapping's [text]",
            )

    def _parsed(self, lines: Sequence[str], names: Sequence[str]) -> pd.DataFrame:
        import pandas as pd

        try:
            frame: pd.DataFrame = pd.read_csv(
                io.StringIO("\n".join(lines)),
                sep=self._delimiter if self._delimiter != " " else r"\s+",
                header=None,
                names=list(names),
                index_col=False,
                # Where a comma is the decimal mark, each cell decides what its points mean: see `_cells`.
                dtype="str" if self._options.decimal == "," or self._options.thousands else None,
                skipinitialspace=True,
                skip_blank_lines=False,
            )
            return frame
        except (pd.errors.ParserError, OverflowError) as error:
            raise RecordingError(
                f"not a table of {len(names)} columns: {error}",
                where=str(self.path),
                remedy="check delimiter, skip_rows and encoding in the mapping's [text]",
            ) from error

    def _cells(self, series: pd.Series[float]) -> Cells:
        """Return a parsed column as numbers where pandas found nothing else in this piece, else as text with points."""
        if series.dtype.kind in "iuf":
            return series.to_numpy()
        cells = ["" if absent else str(cell) for cell, absent in zip(series, series.isna(), strict=True)]
        decimal, thousands = self._options.decimal, self._options.thousands
        if decimal == "," and not thousands:
            pointed = next((cell for cell in cells if "." in cell and np.isfinite(number(cell))), None)
            if pointed is not None:
                raise RecordingError(
                    f"'{pointed[:40]}' in column '{series.name}' has a point, where the comma is the decimal mark",
                    where=str(self.path),
                    remedy='if it parts thousands, give thousands = "." in the mapping\'s [text]; else correct decimal',
                )
        return texts([_plain(cell, decimal, thousands) for cell in cells])

    def _lines(self, skipped: int) -> Iterator[tuple[int, str]]:
        """Yield the lines that hold data or names, with their places in the file."""
        comment = self._options.comment
        try:
            with self.path.open(encoding=self._encoding, newline=None) as file:
                for place in itertools.count():
                    line = file.readline(_LONGEST_LINE)
                    if not line:
                        return
                    if len(line) == _LONGEST_LINE:
                        raise RecordingError(f"line {place + 1} is endless", where=str(self.path), remedy=_NO_TEXT)
                    line = line.partition(comment)[0] if comment else line
                    if place >= skipped and line.strip():
                        yield place, line.rstrip("\n")
        except (ValueError, LookupError) as error:
            raise RecordingError(
                f"not text in {self._encoding}: {error}", where=str(self.path), remedy=_NO_TEXT
            ) from error

    def _fitted(self, names: list[str], rows: Sequence[list[str]]) -> list[str]:
        """Return the names that the first rows have cells for: those may end with empty cells, or names with none."""
        trimmed = list(names)
        while len(trimmed) > 1 and not trimmed[-1]:
            trimmed.pop()
        for able in (names, trimmed):
            if not rows or any(len(row) >= len(able) and not any(row[len(able) :]) for row in rows):
                return able
        raise RecordingError(
            f"its line of names has {len(names)} cells, and its rows have {len(rows[0])}: which is whose, nobody knows",
            where=str(self.path),
            remedy="correct the line of names; or leave it out (skip_rows, header = false) and number the columns",
        )

    def _is_number(self, cell: str) -> bool:
        """Whether a cell is no name: a number, a date, or nothing."""
        plain = _plain(cell, self._options.decimal, self._options.thousands)
        return not cell or bool(_DATE.fullmatch(cell)) or plain.lower() == "nan" or not np.isnan(number(plain))


_NO_TEXT = "set encoding in the mapping's [text], or format where the file is no text at all"


def _plain(cell: str, decimal: str, thousands: str | None) -> str:
    """Return a number as it is written with a point; thousands are parted in threes, or it is none."""
    cell = cell.strip()
    if thousands and thousands in cell:
        whole, mark, rest = cell.partition(decimal)
        parted = rf"[+-]?\d{{1,3}}({re.escape(thousands)}\d{{3}})+"
        cell = whole.replace(thousands, "") + mark + rest if re.fullmatch(parted, whole, re.ASCII) else ""
    return cell.replace(decimal, ".")


def _without_empty_end(line: str, delimiter: str, surplus: int) -> str:
    """Return a line without so many empty cells at its end; "" where they are not empty."""
    for _ in range(surplus):
        line = line.rstrip(" ")
        if not line.endswith(delimiter):
            return ""
        line = line[: -len(delimiter)]
    return line


def sniff_delimiter(lines: Sequence[str], decimal: str = ".") -> str:
    """Return the delimiter that splits `lines` into most columns; "," where none does, " " for blanks.

    The `decimal` mark splits numbers, and no columns.
    """
    able = DELIMITERS.replace(decimal, "")

    def usual(counts: Iterable[int]) -> int:  # but for a few lines, such as those between the sections of a log
        return sorted(counts)[len(lines) // 4]

    best = max(able, key=lambda delimiter: usual(line.count(delimiter) for line in lines))
    if usual(line.count(best) for line in lines):
        return best
    return " " if usual(len(line.split()) for line in lines) > 1 else able.strip("\t|")[-1]


def _split(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        cells = line.split()
    else:
        try:
            cells = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))
        except csv.Error:  # no line of a table
            cells = line.split(delimiter)
    return [cell.strip().strip('"') for cell in cells]


def _unique(names: Sequence[str]) -> tuple[str, ...]:
    """Return `names`, those that come again with " (1)", " (2)"... added, and a number for those left empty."""
    named = [name or str(position) for position, name in enumerate(names, start=1)]
    counts = Counter(named)
    taken = {name for name in named if counts[name] == 1}
    seen = Counter[str]()
    unique = []
    for name in named:
        free = name
        while counts[name] > 1 and (free == name or free in taken):
            seen[name] += 1
            free = f"{name} ({seen[name]})"
        taken.add(free)
        unique.append(free)
    return tuple(unique)


FORMAT = Format(suffixes=(".csv", ".tsv", ".txt", ".dat", ".asc"), read=TextTable, isolated=False)
