"""Arrays as MATLAB and NumPy save them, as columns. Read in a child process (isolated.py), as all binary files are."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from kbs_process.studies.convert.binary import Series, Slice, open_hdf5
from kbs_process.studies.convert.tables import Cells, Column

_HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_MATLAB_HEADER = 512  # bytes that MATLAB writes before the HDF5 file


def open_matlab(path: Path) -> Iterator[Series]:
    """Numeric variables by name; the columns of a matrix "name[1]". Its longer side is time."""
    with path.open("rb") as file:
        head = file.read(_MATLAB_HEADER + len(_HDF5_SIGNATURE))
    if head[_MATLAB_HEADER:] == _HDF5_SIGNATURE or head.startswith(_HDF5_SIGNATURE):  # since MATLAB 7.3
        yield from open_hdf5(path)
        return
    from scipy.io import loadmat

    for name, data in loadmat(path, mat_dtype=False).items():
        if isinstance(data, np.ndarray) and data.dtype.kind in "iufb" and data.ndim == 2:
            yield from _columns(data, name)


def open_numpy(path: Path) -> Iterator[Series]:
    """One array of one or two dimensions: columns "[1]", "[2]"... along its shorter side, fields of records by name."""
    data = np.load(path, mmap_mode="r", allow_pickle=False)
    if data.dtype.names and data.ndim == 1:
        for field in data.dtype.names:
            yield Series(Column(field), len(data), _rows_of(data[field]))
    elif data.dtype.kind in "iufb" and data.ndim in (1, 2):
        yield from _columns(data if data.ndim == 2 else data[:, None], "")


def _columns(data: Cells, name: str) -> Iterator[Series]:
    upright = data if data.shape[0] >= data.shape[1] else data.T
    rows, width = upright.shape
    for index in range(width):
        label = name if name and width == 1 else f"{name}[{index + 1}]"
        yield Series(Column(label), rows, _rows_of(upright[:, index]))


def _rows_of(data: Cells) -> Slice:
    return lambda first, count: np.asarray(data[first : first + count])
