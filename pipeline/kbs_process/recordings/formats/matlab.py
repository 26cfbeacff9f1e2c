"""MATLAB: numeric variables by name, the columns of a matrix "name[1]"; since MATLAB 7.3 a file is one of HDF5."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kbs_process.recordings.formats import Format, Text
from kbs_process.recordings.formats.hdf5 import read_hdf5
from kbs_process.recordings.tables import SeriesTable, series_of

_HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_MATLAB_HEADER = 512  # bytes that MATLAB writes before the HDF5 file


def read_matlab(path: Path, text: Text) -> SeriesTable:
    """Open a .mat file of any version."""
    with path.open("rb") as file:
        head = file.read(_MATLAB_HEADER + len(_HDF5_SIGNATURE))
    if head[_MATLAB_HEADER:] == _HDF5_SIGNATURE or head.startswith(_HDF5_SIGNATURE):
        return read_hdf5(path, text)
    from scipy.io import loadmat

    arrays = {name: data for name, data in loadmat(path, mat_dtype=False).items() if isinstance(data, np.ndarray)}
    return SeriesTable(path, (one for name, data in arrays.items() for one in series_of(data, name)))


FORMAT = Format(suffixes=(".mat",), read=read_matlab)
