"""TDMS: channels "group/channel"; a waveform's own time is a column "group/channel: time"."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from kbs_process.recordings.formats import Format, Text
from kbs_process.recordings.tables import Cells, Column, Item, Series, SeriesTable, Slice, stamps_after, texts

_CLOCK = ("wf_start_time", "wf_start_offset", "wf_increment")
_UNITS = ("unit_string", "NI_UnitDescription")
_SCALE = "NI_Scal"  # what begins the names of properties that scale a channel, or say that it is scaled
_SCALES = {"Linear", "Polynomial", "RTD", "Strain", "Table", "Thermistor", "Thermocouple", "Add", "Subtract"}
_SCALES |= {"AdvancedAPI"}  # which the file's writer applied


def read_tdms(path: Path, _: Text) -> SeriesTable:
    """Open a TDMS file; an index beside it, which may belong to another, is not used."""
    return SeriesTable(path, _series(path))


def _series(path: Path) -> Iterator[Item]:
    from nptdms import TdmsFile

    changed = _changed(path)
    file = TdmsFile.open(path.open("rb"))
    if file.file_status.incomplete_final_segment:
        yield Counter({"file breaks off within its last segment, of which what there is is read": 1})
    for group in file.groups():
        for channel in group.channels():
            name = f"{group.name}/{channel.name}"
            if channel.dtype is None or len(channel) == 0:
                continue
            if np.dtype(channel.dtype).kind == "c":
                yield f"{name}: it holds complex numbers"
                continue
            scales = {kind for key, kind in channel.properties.items() if key.endswith("_Scale_Type")}
            if any(owner == channel.path and key not in _CLOCK for owner, key in changed):
                yield f"{name}: its scale or unit changes within the file: split the file"
                continue
            if odd := sorted(map(str, scales - _SCALES)):
                yield f"{name}: its scale '{odd[0]}' is not known: save it scaled"
                continue
            step, axis = channel.properties.get("wf_increment"), channel.properties.get("wf_xunit_string")
            clock = ""
            if axis not in (None, "", "s"):
                yield f"{name}: time: it is stated in '{axis}', not in s"
            elif any(owner == channel.path for owner, _ in changed):
                yield f"{name}: time: its start or step changes within the file, so it has no clock: split the file"
            elif isinstance(step, int | float) and 0.0 < step < np.inf:
                clock = f"{name}: time"
            unit = next((str(given) for key in _UNITS if (given := channel.properties.get(key))), "")
            yield Series(Column(name, unit, clock), len(channel), _data(channel))
            if clock:
                yield Series(Column(clock, "datetime"), len(channel), _time(channel))


def _changed(path: Path) -> set[tuple[str, str]]:
    """Return what a later segment changes, by channel and property: time, scale or unit, of which the last is kept."""
    from nptdms.reader import TdmsReader

    first: dict[tuple[str, str], Any] = {}
    changed: set[tuple[str, str]] = set()

    class Reader(TdmsReader):  # type: ignore[misc]
        def _update_object_properties(self, properties: Any) -> None:
            for owner, pairs in (properties or {}).items():
                for key, value in pairs:
                    kept = key in _CLOCK + _UNITS or key.startswith(_SCALE)
                    if kept and first.setdefault((owner, key), value) != value:
                        changed.add((owner, key))
            super()._update_object_properties(properties)

    with path.open("rb") as file:
        Reader(file).read_metadata()
    return changed


def _data(channel: Any) -> Slice:
    def read(first: int, count: int) -> Cells:
        data = np.asarray(channel.read_data(first, min(count, max(len(channel) - first, 0))))
        return data if data.dtype.kind not in "OU" else texts(map(str, data.tolist()))

    return read


def _time(channel: Any) -> Slice:
    properties = channel.properties
    start = np.datetime64(properties.get("wf_start_time", 0), "ns")
    offset, step = float(properties.get("wf_start_offset", 0.0)), float(properties["wf_increment"])

    def read(first: int, count: int) -> Cells:
        index = np.arange(first, min(first + count, len(channel)), dtype=np.float64)
        return stamps_after(start, offset + index * step)

    return read


FORMAT = Format(suffixes=(".tdms",), read=read_tdms, library="nptdms")
