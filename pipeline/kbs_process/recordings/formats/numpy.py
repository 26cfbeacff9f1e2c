"""NumPy: one array of one or two dimensions, columns "[1]", "[2]"... along its shorter side, or records by field."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kbs_process.recordings.formats import Format, Text
from kbs_process.recordings.tables import Column, Series, SeriesTable, rows_of, series_of


def read_numpy(path: Path, _: Text) -> SeriesTable:
    """Open a .npy file."""
    data = np.load(path, mmap_mode="r", allow_pickle=False)
    if data.dtype.names and data.ndim == 1:
        fields = data.dtype.names
        return SeriesTable(path, (Series(Column(field), len(data), rows_of(data[field])) for field in fields))
    return SeriesTable(path, series_of(data, ""))


FORMAT = Format(suffixes=(".npy",), read=read_numpy)
