"""HDF5: data sets of numbers by name, columns of a matrix "name[1]", fields of compounds "name[Fx]"."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from kbs_process.recordings.formats import Format, Text
from kbs_process.recordings.tables import Column, Series, SeriesTable, rows_of, series_of


def read_hdf5(path: Path, _: Text) -> SeriesTable:
    """Open an HDF5 file; a data set's unit is its attribute "unit" or "units"."""
    return SeriesTable(path, _series(path))


def _series(path: Path) -> Iterator[Series]:
    import h5py

    file = h5py.File(path, "r")
    found: list[tuple[str, Any]] = []
    file.visititems(lambda name, node: found.append((name, node)) if isinstance(node, h5py.Dataset) else None)
    for name, data in found:
        unit = _text(data.attrs.get("unit", data.attrs.get("units", "")))
        if data.dtype.names and data.ndim == 1:
            for field in data.dtype.names:
                yield Series(Column(f"{name}[{field}]", unit), len(data), rows_of(data.fields(field)))
        else:
            yield from series_of(data, name, unit)


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


FORMAT = Format(suffixes=(".h5", ".hdf5", ".hdf"), read=read_hdf5, library="h5py")
