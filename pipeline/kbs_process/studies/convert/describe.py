"""What is in a source file, as the beginning of a mapping."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kbs_process.campaign.documents import quoted
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
        return f"# {counts}  {low:>12}  {high:>12}  {printable(self.column.unit):<8}  {printable(self.column.name)}"


def describe(source: Path) -> str:
    """Return a mapping to be completed, whose comments list the columns of `source` with their ranges.

    Raises RecordingError where the file cannot be read.
    """
    table = open_table(source)
    ranges = _ranges(table)
    header = f"# {'no.':>4}  {'rows':>9}  {'no num.':>7}  {'least':>12}  {'greatest':>12}  {'unit':<8}  column"
    listing = "\n".join([header, *(entry.line(1 + index) for index, entry in enumerate(ranges))])
    told = [f"left out: {one}" for one in table.left_out] + [f"{count} {what}" for what, count in table.odd.items()]
    notes = "".join(f"# {printable(' '.join(one.split()))}\n" for one in told)
    head = f"#:schema import.schema.json\n# Columns of {printable(source.name)}\n"
    return f"{head}{listing}\n{notes}\n{_skeleton(source, ranges)}"


def _ranges(table: Table) -> list[Range]:
    """Read the whole file."""
    ranges = [Range(column) for column in table.columns]
    for cells in table.chunks([entry.column.name for entry in ranges]):
        for entry, one in zip(ranges, cells, strict=True):
            entry.add(one)
    return ranges


def _skeleton(source: Path, ranges: Sequence[Range]) -> str:
    """Return the keys of a mapping; what only the user knows is marked by "..."."""
    named = [entry.column.name for entry in ranges]
    clocked = any(entry.column.clock for entry in ranges)
    time = next((name for name in named if "time" in name.lower()), None)
    if clocked:
        clock = "# [time]: left out, the file has its own"
    elif time is not None:
        clock = f'[time]\ncolumn = {quoted(time)}\nunit = "s"'
    else:
        clock = "[time]\nrate_Hz = 1000.0  # rows a second; or give column and unit"
    example = quoted(next((name for name in named if name != time), named[0]))
    return f"""schema = 1
campaign = "campaign.toml"  # its description: copy one, such as that of campaigns/EL089, with its parameter files

{clock}

[wrench]  # Fx ... Tz: force and moment that the unit exerts on the transducer, about and in T
Fx = {{ column = {example}, unit = "N", scale = 1.0 }}

[encoder]  # one for each joint of the rig; where rates are measured instead, [rate]
az = {{ column = "...", unit = "deg", unwrap = false }}

[[recording]]
source = {quoted(source.name)}
trajectory = "..."
role = "fit"  # "calibration", "fit" or "held-out"
repeat = 1
"""
