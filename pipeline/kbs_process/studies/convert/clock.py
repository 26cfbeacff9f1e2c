"""Time as files write it, to nanoseconds since 1970-01-01."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from datetime import UTC, datetime, timedelta
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kbs_process.errors import RecordingError
from kbs_process.recordings.tables import Cells, number, too_coarse
from kbs_process.signals.records import Array, Mask, Stamps
from kbs_process.studies.convert.mapping_file import Time

_NS = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1000, "ns": 1, "min": 60_000_000_000}
_DAYS = ("%d.%m.%Y", "%d.%m.%y", "%d/%m/%Y", "%m/%d/%Y", "%d/%m/%y", "%m/%d/%y", "%d-%m-%Y", "%m-%d-%Y", "%Y/%m/%d")
_PARTS = ("", ".%f", ":%f")  # of a second; a comma is read as a point
_HOURS = ("%H:%M:%S", "%I:%M:%S", "%H:%M")
_FORMATS = [
    day + between + hour + part + half
    for day, between, hour, part, half in product(
        (*_DAYS, "%d %b %Y", "%d-%b-%Y", "%d-%b-%y"), (" ", ". ", ";", "T"), _HOURS, _PARTS, ("", " %p")
    )
] + [hour + part + half for hour, part, half in product(_HOURS, _PARTS, ("", " %p"))]  # fmt: skip
_GREATEST = 2.0**63 - 1024.0  # ns, the greatest double that an int64 holds


def numbers(cells: Cells) -> Array:
    """Return cells as doubles, bit for bit where they are; NaN where a text is no number."""
    if cells.dtype.kind in "iufb":
        return cells.astype(np.float64)
    words = [str(cell) for cell in cells.tolist()]
    together = "".join(words)
    if together.isascii() and "_" not in together:  # then Python reads a number as we do
        with suppress(ValueError):
            return np.array(list(map(float, words)), dtype=np.float64)
    return np.array(list(map(number, words)), dtype=np.float64)


def nanoseconds(cells: Cells, time: Time, where: str) -> tuple[Stamps, Mask]:
    """Return the stamps (n,) in ns of cells that hold times or count samples, and which of them are times.

    Integers stay exact. A double of t seconds is known to t * 1.1e-16; the nearest nanosecond is exact
    below 4e6 s.
    """
    if cells.dtype.kind == "M":
        return _from_dates(cells)
    if time.unit == "datetime":
        return _from_texts(cells, time, where)
    start = epoch_ns(time.start)
    if why := too_coarse(cells, 1e-9 * _NS[time.unit] if time.rate_Hz is None else 1.0 / time.rate_Hz):
        remedy = "give rate_Hz in the mapping's [time], or record times as 64 bits"
        raise RecordingError(why, where=where, remedy=remedy)
    if time.rate_Hz is not None:
        return _rounded(numbers(cells) / time.rate_Hz * 1e9, start)
    scale = _NS[time.unit]
    if cells.dtype.kind in "iu" and np.abs(cells.astype(np.float64)).max(initial=0.0) * scale < _GREATEST:
        return cells.astype(np.int64) * scale + start, np.ones(len(cells), dtype=np.bool_)
    with np.errstate(over="ignore"):  # infinity is no time either
        return _rounded(numbers(cells) * scale, start)


def date_formats(words: Sequence[str]) -> list[str]:
    """Return in which usual formats all words are dates and times, or times of day; none where they are ISO 8601."""
    found = _FORMATS if words and not _reads(words[0], None) else []
    for word in (word.replace(",", ".") for word in words):
        found = [one for one in found if ("%I" in one) == ("%p" in one) and _reads(word, one)]
    return found


def _reads(word: str, how: str | None) -> bool:
    try:
        return bool(datetime.fromisoformat(word) if how is None else datetime.strptime(word, how))
    except ValueError:
        return False


def epoch_ns(start: datetime | None) -> int:
    """Return a date and time as ns since 1970-01-01T00:00:00Z, exactly."""
    if start is None:
        return 0
    return (start - datetime(1970, 1, 1, tzinfo=UTC)) // timedelta(microseconds=1) * 1000


def _rounded(ns: Array, start: int) -> tuple[Stamps, Mask]:
    known = np.abs(ns) < _GREATEST / 2  # False for NaN too
    return np.rint(np.where(known, ns, 0.0)).astype(np.int64) + start, known


def _from_dates(cells: NDArray[Any]) -> tuple[Stamps, Mask]:
    return cells.astype("datetime64[ns]").astype(np.int64), ~np.isnat(cells)


def _from_texts(cells: Cells, time: Time, where: str) -> tuple[Stamps, Mask]:
    import pandas as pd

    if cells.dtype.kind in "iuf":
        raise RecordingError(
            "holds numbers, not dates", where=where, remedy='give their unit, such as unit = "s", in [time]'
        )
    how = (time.format or "ISO8601").replace(",", ".")
    words = pd.Series(cells, dtype="str").str.strip().str.replace(",", ".")
    try:
        dates = pd.to_datetime(words, utc=True, format=how, errors="coerce")
    except ValueError as error:
        remedy = 'write it as Python does, such as "%d.%m.%Y %H:%M:%S,%f"'
        raise RecordingError(f"'{how}' is no format of dates: {error}", where=where, remedy=remedy) from None
    stamps, known = _from_dates(dates.dt.tz_localize(None).to_numpy(dtype="datetime64[ns]"))
    if time.format and "%d" not in time.format:  # a time of day, which Python takes to be in 1900
        stamps = stamps + (epoch_ns(time.start) - epoch_ns(datetime(1900, 1, 1, tzinfo=UTC)))
    return stamps, known
