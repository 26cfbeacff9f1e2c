"""What is in a source file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kbs_process.recordings.open_table import open_table
from kbs_process.recordings.tables import Cells, Column, Table
from kbs_process.studies.convert.clock import numbers
from kbs_process.terminal import printable


@dataclass(slots=True)
class Range:
    """What one column holds."""

    column: Column
    rows: int = 0
    absent: int = 0  # cells that are no number
    low: float = math.inf
    high: float = -math.inf
    text: str = ""  # the first cell, where it is no number
    dates: bool = False

    def add(self, cells: Cells) -> None:
        """Take another piece of the column into account."""
        self.dates = self.dates or cells.dtype.kind == "M"
        values = cells.astype("datetime64[ns]").astype(np.float64) if self.dates else numbers(cells)
        finite = values[np.isfinite(values)]
        if not self.rows and len(values) and not len(finite):
            self.text = str(cells[0])
        self.rows += len(values)
        self.absent += len(values) - len(finite)
        if len(finite):
            self.low, self.high = min(self.low, float(finite.min())), max(self.high, float(finite.max()))

    def line(self, number: int) -> str:
        """Return the column's line in the table of columns."""
        if self.dates:
            low, high = (str(np.datetime64(int(x), "ns")) if math.isfinite(x) else "" for x in (self.low, self.high))
        elif self.low <= self.high:
            low, high = f"{self.low:.7g}", f"{self.high:.7g}"
        else:
            low, high = printable(self.text[:20]) or "no number", ""
        counts = f"{number:>4}  {self.rows:>9}  {self.absent:>7}"
        return f"{counts}  {low:>12}  {high:>12}  {printable(self.column.unit):<8}  {printable(self.column.name)}"


def describe(source: Path) -> str:
    """Return a list of the columns of `source` with their ranges, and of what it holds besides.

    Raises RecordingError where the file cannot be read.
    """
    table = open_table(source)
    ranges = _ranges(table)
    header = f"{'no.':>4}  {'rows':>9}  {'no num.':>7}  {'least':>12}  {'greatest':>12}  {'unit':<8}  column"
    listing = "\n".join([header, *(entry.line(1 + index) for index, entry in enumerate(ranges))])
    told = [f"left out: {one}" for one in table.left_out] + [f"{count} {what}" for what, count in table.odd.items()]
    notes = "".join(f"{printable(' '.join(one.split()))}\n" for one in told)
    return f"Columns of {printable(source.name)}\n{listing}\n{notes}"


def _ranges(table: Table) -> list[Range]:
    """Read the whole file."""
    ranges = [Range(column) for column in table.columns]
    for cells in table.chunks([entry.column.name for entry in ranges]):
        for entry, one in zip(ranges, cells, strict=True):
            entry.add(one)
    return ranges
