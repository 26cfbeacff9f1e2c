"""MATLAB: numeric variables by name, columns of a matrix "name[1]", fields of a structure "name.field".

Of an array of structures a field is a column where all have one number in it, else "name(1).field" and so on.

Since MATLAB 7.3 a file is one of HDF5. Tables, timetables and timeseries are objects, which the package mat-io decodes:
variables "name.variable", row times "name.Time", a timeseries' data "name.Data".
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from kbs_process.recordings.formats import Format, Text
from kbs_process.recordings.formats.hdf5 import ELEMENTS, datasets
from kbs_process.recordings.tables import Item, Series, SeriesTable, series_of

_TWICE = re.compile('^Duplicate variable name "(.*)" in stream')
_HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_MATLAB_HEADER = 512  # bytes that MATLAB writes before the HDF5 file
_DEPTH = 8  # of structures within structures
_NAMELESS = "None"
_OBJECT = re.compile(r": (it is an? (?:object|table|timetable|datetime|duration|timeseries)): ")
_UNITS = {
    "seconds": 1e9,
    "milliseconds": 1e6,
    "microseconds": 1e3,
    "nanoseconds": 1.0,
    "minutes": 6e10,
    "hours": 3.6e12,
}
_REMEDY = "export its numbers with s.t = x.Time; s.x = x.Data, or table2struct; tables need 'kbs-process[formats]'"


def read_matlab(path: Path, _: Text) -> SeriesTable:
    """Open a .mat file of any version."""
    with path.open("rb") as file:
        head = file.read(_MATLAB_HEADER + len(_HDF5_SIGNATURE))
    hdf5 = head[_MATLAB_HEADER:] == _HDF5_SIGNATURE or head.startswith(_HDF5_SIGNATURE)
    plain = list(datasets(path, ".", classes=True) if hdf5 else _variables(path))
    objects = [one for one in plain if isinstance(one, str) and _OBJECT.search(one)]
    made: list[Item] = [f"{_label(one)}: {_OBJECT.findall(one)[0]}: {_REMEDY}" for one in objects]
    if objects and find_spec("matio"):
        with suppress(Exception):  # what cannot be decoded is told as it is
            made = list(_objects(path))
    read = [one.column.name for one in made if isinstance(one, Series)]
    told = {_label(one) for one in made if isinstance(one, str)}
    kept = [one for one in plain if not (isinstance(one, str) and (_label(one) in told or _is_read(_label(one), read)))]
    return SeriesTable(path, [*kept, *made])


def _label(left_out: str) -> str:
    return left_out.partition(": ")[0]


def _is_read(name: str, read: Sequence[str]) -> bool:
    """Whether an object has columns; SciPy does not know the names of objects, which are all told again."""
    return (name == _NAMELESS and bool(read)) or any(one == name or one.startswith(f"{name}.") for one in read)


def _variables(path: Path) -> Iterator[Item]:
    """Yield the columns of a file of version 4 or 5."""
    from scipy.io import loadmat, whosmat
    from scipy.io.matlab import matfile_version

    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        variables = loadmat(path, mat_dtype=False)
    # Of variables that are called the same, only the last is loaded; of version 4 it is not said.
    again = [name for one in said for name in _TWICE.findall(str(one.message))]
    every = [name for name, *_ in whosmat(path)] if matfile_version(path)[0] == 0 else [*variables, *again]
    names = [name for name in every if not name.startswith("__")]
    yield from (one for name in names for one in _columns(variables[name], name, _DEPTH))


def _columns(data: Any, name: str, depth: int) -> Iterator[Item]:
    """Yield the columns of a variable, or of a field."""
    if type(data) is not np.ndarray and data.dtype.kind in "iufbc":
        yield f"{name}: it is a sparse matrix: save full(x)"
    elif type(data) is not np.ndarray:  # tables and their like are arrays of a kind of their own
        yield f"{name}: it is an object: {_REMEDY}"
    elif data.dtype.names and data.size == 1 and depth:
        for field in data.dtype.names:
            yield from _columns(data.flat[0][field], f"{name}.{field}", depth - 1)
    elif data.dtype.names and 1 < data.size <= ELEMENTS and depth:
        for field in data.dtype.names:
            values = [one[field] for one in data.flat]
            if all(type(one) is np.ndarray and one.dtype.kind in "iufb" and one.size == 1 for one in values):
                yield from series_of(np.concatenate([one.ravel() for one in values]), f"{name}.{field}")
            else:
                for index, one in enumerate(values, start=1):
                    yield from _columns(one, f"{name}({index}).{field}", depth - 1)
    elif data.dtype.names or data.dtype.kind == "O":
        yield f"{name}: it is an array of cells, structures or objects: save each field as numbers"
    elif data.dtype.kind == "U":
        yield f"{name}: it is text"
    elif data.size:
        yield from series_of(data, name)


def _objects(path: Path) -> Iterator[Item]:
    """Yield the columns of tables, timetables and dates, wherever they are; other objects are told."""
    from matio import load_from_mat

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        variables = load_from_mat(path, add_table_attrs=True)
    for name, data in variables.items():
        yield from _decoded(data, name, _DEPTH)


def _decoded(data: Any, name: str, depth: int) -> Iterator[Item]:
    import pandas as pd
    from matio.utils import MatlabOpaque

    if isinstance(data, pd.DataFrame):
        clock = ""
        if data.index.dtype.kind in "mM":
            clock, times = f"{name}.{data.index.name}", data.index.to_numpy()
            after = np.datetime64(0, "ns") if times.dtype.kind == "m" else np.timedelta64(0, "ns")
            yield from series_of(after + times, clock, "datetime")
        units = [str(unit) for unit in data.attrs.get("varUnits", data.attrs.get("VariableUnits", []))]
        same = len(units) == len(data.columns)  # else a variable has several columns
        for unit, label in zip(units if same else [""] * len(data.columns), data.columns, strict=True):
            values = data[label].to_numpy()
            lasts = values.dtype.kind == "m"
            for one in series_of(_seconds(values) if lasts else values, f"{name}.{label}", "s" if lasts else unit):
                yield replace(one, column=replace(one.column, clock=clock)) if isinstance(one, Series) else one
    elif isinstance(data, MatlabOpaque):
        yield from _timeseries(data.properties, name) or [f"{name}: it is a {data.classname}: {_REMEDY}"]
    elif isinstance(data, np.ndarray) and data.dtype.names and data.size == 1 and depth:
        for field in data.dtype.names:
            yield from _decoded(data.flat[0][field], f"{name}.{field}", depth - 1)
    elif data.dtype.kind == "M":
        yield from series_of(data, name, "datetime")
    elif data.dtype.kind == "m":
        yield from series_of(_seconds(data), name, "s")
    elif data.dtype.kind not in "iufbc":
        yield f"{name}: it is text, or an array of cells, structures or objects: save each field as numbers"


def _timeseries(properties: Any, name: str) -> list[Item]:
    """Return the columns of a timeseries by its own time; none of another object, or where rows and times do not agree.

    Times are in one property, or, where they are uniform, in that which describes them.
    """
    values, own = (np.asarray(properties.get(key, ())) for key in ("Data_", "Time_"))
    described = (getattr(one, "properties", None) for one in properties.values())
    about: Any = next((one for one in described if one and "Increment_" in one), {})
    unit = _UNITS.get("".join(np.ravel(about.get("Units", "seconds")).astype(str)))
    if not own.size and about:
        start, step, length = (float(np.ravel(about[key])[0]) for key in ("Start_", "Increment_", "Length"))
        own = start + step * np.arange(int(length))
    rows = own.size
    if unit is None or not rows or rows not in (values.shape[0], values.shape[-1]) or own.dtype.kind not in "iuf":
        return []
    first = values if values.shape[0] == rows else np.moveaxis(values, -1, 0)
    clock = f"{name}.Time"
    times = np.datetime64(0, "ns") + np.rint(own.ravel() * unit).astype("m8[ns]")
    columns = series_of(first.reshape(rows, -1), f"{name}.Data")
    return [
        *series_of(times, clock, "datetime"),
        *(replace(one, column=replace(one.column, clock=clock)) if isinstance(one, Series) else one for one in columns),
    ]


def _seconds(durations: Any) -> Any:
    return np.where(np.isnat(durations), np.nan, durations.astype("m8[ns]").astype(np.float64) / 1e9)


FORMAT = Format(suffixes=(".mat",), read=read_matlab)
