"""HDF5, TDMS and MDF4 as columns. Read in a child process (isolated.py): a damaged file may end the interpreter."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC
from pathlib import Path
from typing import Any

import numpy as np

from kbs_process.studies.convert.tables import CHUNK_ROWS, Cells, Column

# Cells first .. first + count of one column; fewer at its end, none beyond.
Slice = Callable[[int, int], Cells]


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


def open_hdf5(path: Path) -> Iterator[Series]:
    """Data sets of one dimension; columns of those of two, "name[1]"; fields of compounds, "name[Fx]".

    The longer side of a two-dimensional data set is time (MATLAB writes its arrays transposed).
    """
    import h5py

    file = h5py.File(path, "r")
    found: list[tuple[str, Any]] = []
    file.visititems(lambda name, node: found.append((name, node)) if isinstance(node, h5py.Dataset) else None)
    for name, data in found:
        unit = _text(data.attrs.get("unit", data.attrs.get("units", "")))
        if data.dtype.names and data.ndim == 1:
            for field in data.dtype.names:
                yield Series(Column(f"{name}[{field}]", unit), len(data), _rows_of(data.fields(field)))
        elif data.ndim == 1 and data.dtype.kind in "iufb":
            yield Series(Column(name, unit), len(data), _rows_of(data))
        elif data.ndim == 2 and data.dtype.kind in "iufb":
            upright = data.shape[0] >= data.shape[1]
            rows, width = data.shape if upright else data.shape[::-1]
            for index in range(width):
                label = name if width == 1 else f"{name}[{index + 1}]"
                yield Series(Column(label, unit), rows, _line_of(data, index, upright))


def _rows_of(data: Any) -> Slice:
    return lambda first, count: np.asarray(data[first : first + count])


def _line_of(data: Any, index: int, upright: bool) -> Slice:
    if upright:
        return lambda first, count: np.asarray(data[first : first + count, index])
    return lambda first, count: np.asarray(data[index, first : first + count])


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def open_tdms(path: Path) -> Iterator[Series]:
    """Channels, "group/channel"; a waveform's own time is a column "group/channel: time"."""
    from nptdms import TdmsFile

    file = TdmsFile.open(path)
    for group in file.groups():
        for channel in group.channels():
            if channel.dtype is None or len(channel) == 0:
                continue
            name = f"{group.name}/{channel.name}"
            clock = f"{name}: time" if "wf_increment" in channel.properties else ""
            unit = str(channel.properties.get("unit_string", ""))
            yield Series(Column(name, unit, clock), len(channel), _tdms_data(channel))
            if clock:
                yield Series(Column(clock, "datetime"), len(channel), _tdms_time(channel))


def _tdms_data(channel: Any) -> Slice:
    def read(first: int, count: int) -> Cells:
        data = np.asarray(channel.read_data(first, min(count, max(len(channel) - first, 0))))
        return data if data.dtype.kind != "O" else data.astype(np.str_)

    return read


def _tdms_time(channel: Any) -> Slice:
    properties = channel.properties
    start = np.datetime64(properties.get("wf_start_time", 0), "ns").astype(np.int64)
    offset, step = float(properties.get("wf_start_offset", 0.0)), float(properties["wf_increment"])

    def read(first: int, count: int) -> Cells:
        index = np.arange(first, min(first + count, len(channel)), dtype=np.float64)
        return (start + np.rint((offset + index * step) * 1e9).astype(np.int64)).astype("datetime64[ns]")

    return read


def open_mdf(path: Path) -> Iterator[Series]:
    """Channels under their names; "group/channel", groups counted from 0, where several groups have that name."""
    from asammdf import MDF

    file: Any = MDF(path)
    start = np.datetime64(file.start_time.astimezone(UTC).replace(tzinfo=None), "ns")
    for number, group in enumerate(file.groups):
        master = file.masters_db.get(number)
        clock = "" if master is None else f"{number}: time"
        rows = int(group.channel_group.cycles_nr)
        if clock and rows:
            yield Series(Column(clock, "datetime"), rows, _mdf_time(file, number, rows, start))
        for index, channel in enumerate(group.channels):
            if index == master or not rows:
                continue
            name = channel.name if len(file.channels_db[channel.name]) == 1 else f"{number}/{channel.name}"
            yield Series(Column(name, str(channel.unit or ""), clock), rows, _mdf_data(file, number, index, rows))


def _mdf_data(file: Any, group: int, index: int, rows: int) -> Slice:
    def read(first: int, count: int) -> Cells:
        if first >= rows:
            return np.empty(0)
        signal = file.get(group=group, index=index, record_offset=first, record_count=min(count, rows - first))
        samples = np.asarray(signal.samples)
        return np.char.decode(samples, "utf-8", "replace") if samples.dtype.kind == "S" else samples

    return read


def _mdf_time(file: Any, group: int, rows: int, start: Any) -> Slice:
    def read(first: int, count: int) -> Cells:
        if first >= rows:
            return np.empty(0, dtype="datetime64[ns]")
        master = file.get_master(group, record_offset=first, record_count=min(count, rows - first))
        stamps: Cells = start + np.rint(np.asarray(master, dtype=np.float64) * 1e9).astype("timedelta64[ns]")
        return stamps

    return read
