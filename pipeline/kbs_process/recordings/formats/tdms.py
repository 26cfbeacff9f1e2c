"""TDMS: channels "group/channel"; a waveform's own time is a column "group/channel: time"."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from kbs_process.recordings.formats import Format, Text
from kbs_process.recordings.tables import Cells, Column, Series, SeriesTable, Slice


def read_tdms(path: Path, _: Text) -> SeriesTable:
    """Open a TDMS file."""
    return SeriesTable(path, _series(path))


def _series(path: Path) -> Iterator[Series]:
    from nptdms import TdmsFile

    file = TdmsFile.open(path)
    for group in file.groups():
        for channel in group.channels():
            if channel.dtype is None or len(channel) == 0:
                continue
            name = f"{group.name}/{channel.name}"
            clock = f"{name}: time" if "wf_increment" in channel.properties else ""
            unit = str(channel.properties.get("unit_string", ""))
            yield Series(Column(name, unit, clock), len(channel), _data(channel))
            if clock:
                yield Series(Column(clock, "datetime"), len(channel), _time(channel))


def _data(channel: Any) -> Slice:
    def read(first: int, count: int) -> Cells:
        data = np.asarray(channel.read_data(first, min(count, max(len(channel) - first, 0))))
        return data if data.dtype.kind != "O" else data.astype(np.str_)

    return read


def _time(channel: Any) -> Slice:
    properties = channel.properties
    start = np.datetime64(properties.get("wf_start_time", 0), "ns").astype(np.int64)
    offset, step = float(properties.get("wf_start_offset", 0.0)), float(properties["wf_increment"])

    def read(first: int, count: int) -> Cells:
        index = np.arange(first, min(first + count, len(channel)), dtype=np.float64)
        return (start + np.rint((offset + index * step) * 1e9).astype(np.int64)).astype("datetime64[ns]")

    return read


FORMAT = Format(suffixes=(".tdms",), read=read_tdms, library="nptdms")
