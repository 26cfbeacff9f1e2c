"""MATLAB: numeric variables by name, columns of a matrix "name[1]", fields of a structure "name.field".

Since MATLAB 7.3 a file is one of HDF5.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from kbs_process.recordings.formats import Format, Text
from kbs_process.recordings.formats.hdf5 import datasets
from kbs_process.recordings.tables import Item, SeriesTable, series_of

_TWICE = re.compile('^Duplicate variable name "(.*)" in stream')
_HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_MATLAB_HEADER = 512  # bytes that MATLAB writes before the HDF5 file
_DEPTH = 8  # of structures within structures


def read_matlab(path: Path, _: Text) -> SeriesTable:
    """Open a .mat file of any version."""
    with path.open("rb") as file:
        head = file.read(_MATLAB_HEADER + len(_HDF5_SIGNATURE))
    if head[_MATLAB_HEADER:] == _HDF5_SIGNATURE or head.startswith(_HDF5_SIGNATURE):
        return SeriesTable(path, datasets(path, ".", classes=True))
    from scipy.io import loadmat, whosmat
    from scipy.io.matlab import matfile_version

    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        variables = loadmat(path, mat_dtype=False)
    # Of variables that are called the same, only the last is loaded; of version 4 it is not said.
    again = [name for one in said for name in _TWICE.findall(str(one.message))]
    every = [name for name, *_ in whosmat(path)] if matfile_version(path)[0] == 0 else [*variables, *again]
    names = [name for name in every if not name.startswith("__")]
    return SeriesTable(path, (one for name in names for one in _columns(variables[name], name, _DEPTH)))


def _columns(data: Any, name: str, depth: int) -> Iterator[Item]:
    """Yield the columns of a variable, or of a field."""
    if type(data) is not np.ndarray:  # tables and their like are arrays of a kind of their own
        yield f"{name}: it is a sparse matrix, or an object: save full(x), or table2struct(x)"
    elif data.dtype.names and data.size == 1 and depth:
        for field in data.dtype.names:
            yield from _columns(data.flat[0][field], f"{name}.{field}", depth - 1)
    elif data.dtype.names or data.dtype.kind == "O":
        yield f"{name}: it is an array of cells, structures or objects: save each field as numbers"
    elif data.dtype.kind == "U":
        yield f"{name}: it is text"
    elif data.size:
        yield from series_of(data, name)


FORMAT = Format(suffixes=(".mat",), read=read_matlab)
