"""MDF4: channels by name; "group/channel", groups counted from 0, where several groups have that name."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from datetime import UTC
from pathlib import Path
from typing import Any

import numpy as np

from kbs_process.recordings.formats import Format, Text
from kbs_process.recordings.tables import (
    CHUNK_ROWS,
    UNPACKED,
    Cells,
    Column,
    Item,
    Series,
    SeriesTable,
    Slice,
    stamps_after,
    texts,
    too_coarse,
)

# Of a group's master, which else is time.
_SYNCHRONISED_BY = {0: "of no stated kind", 2: "an angle", 3: "a distance", 4: "an index"}
_ALL_INVALID = 1  # among the flags of a channel


def read_mdf(path: Path, _: Text) -> SeriesTable:
    """Open an MDF file; a local time without its zone is taken for UTC, as in other formats."""
    return SeriesTable(path, _series(path))


def _series(path: Path) -> Iterator[Item]:
    from asammdf import MDF

    file: Any = MDF(path)
    begun = file.start_time
    begun = begun.astimezone(UTC).replace(tzinfo=None) if begun.tzinfo else begun
    start = np.datetime64(begun, "ns")
    if file.start_time.tzinfo is None:
        yield Counter({f"file has local times without their zone, taken for UTC: it begins at {begun}": 1})
    for number, group in enumerate(file.groups):
        master = file.masters_db.get(number)
        rows = int(group.channel_group.cycles_nr)
        if not rows:
            continue
        if rows * max(int(group.channel_group.samples_byte_nr), 1) > UNPACKED * path.stat().st_size:
            yield f"{number}: it declares {rows} rows, far more than a file of this size can hold"
            continue
        other = "" if master is None else _SYNCHRONISED_BY.get(getattr(group.channels[master], "sync_type", 1), "")
        if not len(_read(file, number, 0, rows - 1, 1).samples):
            yield Counter({"group of channels ends before the rows that it declares": 1})
        unit = "" if master is None else str(getattr(group.channels[master], "unit", ""))
        if not other and unit not in ("", "s"):
            other = f"stated in '{unit}', not in s"
        if other:
            yield f"{number}: time: the master of that group is {other}, and no time"
        elif master is not None and group.channels[master].dtype_fmt.kind == "f":
            last = _master(file, number, max(0, rows - CHUNK_ROWS), CHUNK_ROWS).astype(group.channels[master].dtype_fmt)
            if other := too_coarse(last):
                yield f"{number}: time: {other}"
        clock = "" if master is None or other else f"{number}: time"
        if clock:
            yield Series(Column(clock, "datetime"), rows, _time(file, number, rows, start))
        for index, channel in enumerate(group.channels):
            if index == master and not other:
                continue
            name = channel.name if len(file.channels_db[channel.name]) == 1 else f"{number}/{channel.name}"
            if getattr(channel, "flags", 0) & _ALL_INVALID:
                yield f"{name}: all its samples are marked as not valid"
                continue
            if _by_formula(channel.conversion):
                yield f"{name}: a formula makes its numbers, which is not computed here: save the numbers"
                continue
            signal = _read(file, number, index, 0, 1)
            head = np.asarray(signal.samples)
            if head.ndim != 1 or head.dtype.names or head.dtype.kind not in "iufbSU":
                yield f"{name}: it holds arrays, structures or bytes"
                continue
            yield Series(Column(name, str(signal.unit or ""), clock), rows, _data(file, number, index, rows))


def _by_formula(conversion: Any) -> bool:
    """Whether a formula has a part in a conversion."""
    inner = getattr(conversion, "referenced_blocks", None) or {}
    return bool(getattr(conversion, "formula", "")) or any(map(_by_formula, inner.values()))


def _read(file: Any, group: int, index: int, first: int, count: int) -> Any:
    """Return samples, with those that are marked as not valid."""
    return file.get(group=group, index=index, record_offset=first, record_count=count, ignore_invalidation_bits=True)


def _master(file: Any, group: int, first: int, count: int) -> Cells:
    return np.asarray(file.get_master(group, record_offset=first, record_count=count), dtype=np.float64)


def _data(file: Any, group: int, index: int, rows: int) -> Slice:
    def read(first: int, count: int) -> Cells:
        if first >= rows:
            return np.empty(0)
        signal = _read(file, group, index, first, min(count, rows - first))
        samples, invalid = np.asarray(signal.samples), signal.invalidation_bits
        if samples.dtype.kind in "SU":
            plain = np.char.decode(samples, "utf-8", "replace") if samples.dtype.kind == "S" else samples
            return texts(plain.tolist() if invalid is None else np.where(invalid, "", plain).tolist())
        return samples if invalid is None or not invalid.any() else np.where(invalid, np.nan, samples)

    return read


def _time(file: Any, group: int, rows: int, start: Any) -> Slice:
    def read(first: int, count: int) -> Cells:
        if first >= rows:
            return np.empty(0, dtype="datetime64[ns]")
        return stamps_after(start, _master(file, group, first, min(count, rows - first)))

    return read


FORMAT = Format(suffixes=(".mf4", ".mdf"), read=read_mdf, library="asammdf")
