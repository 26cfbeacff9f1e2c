"""MDF4: channels by name; "group/channel", groups counted from 0, where several groups have that name."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC
from pathlib import Path
from typing import Any

import numpy as np

from kbs_process.recordings.formats import Format, Text
from kbs_process.recordings.tables import Cells, Column, Series, SeriesTable, Slice


def read_mdf(path: Path, _: Text) -> SeriesTable:
    """Open an MDF file."""
    return SeriesTable(path, _series(path))


def _series(path: Path) -> Iterator[Series]:
    from asammdf import MDF

    file: Any = MDF(path)
    start = np.datetime64(file.start_time.astimezone(UTC).replace(tzinfo=None), "ns")
    for number, group in enumerate(file.groups):
        master = file.masters_db.get(number)
        clock = "" if master is None else f"{number}: time"
        rows = int(group.channel_group.cycles_nr)
        if clock and rows:
            yield Series(Column(clock, "datetime"), rows, _time(file, number, rows, start))
        for index, channel in enumerate(group.channels):
            if index == master or not rows:
                continue
            name = channel.name if len(file.channels_db[channel.name]) == 1 else f"{number}/{channel.name}"
            yield Series(Column(name, str(channel.unit or ""), clock), rows, _data(file, number, index, rows))


def _data(file: Any, group: int, index: int, rows: int) -> Slice:
    def read(first: int, count: int) -> Cells:
        if first >= rows:
            return np.empty(0)
        signal = file.get(group=group, index=index, record_offset=first, record_count=min(count, rows - first))
        samples = np.asarray(signal.samples)
        return np.char.decode(samples, "utf-8", "replace") if samples.dtype.kind == "S" else samples

    return read


def _time(file: Any, group: int, rows: int, start: Any) -> Slice:
    def read(first: int, count: int) -> Cells:
        if first >= rows:
            return np.empty(0, dtype="datetime64[ns]")
        master = file.get_master(group, record_offset=first, record_count=min(count, rows - first))
        stamps: Cells = start + np.rint(np.asarray(master, dtype=np.float64) * 1e9).astype("timedelta64[ns]")
        return stamps

    return read


FORMAT = Format(suffixes=(".mf4", ".mdf"), read=read_mdf, library="asammdf")
