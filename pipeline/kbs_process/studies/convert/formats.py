"""Which reader goes with which file."""

from __future__ import annotations

from pathlib import Path

from kbs_process.errors import RecordingError, did_you_mean
from kbs_process.studies.convert.isolated import IsolatedTable
from kbs_process.studies.convert.mapping import Format, Text
from kbs_process.studies.convert.tables import Table
from kbs_process.studies.convert.text import TextTable

SUFFIXES: dict[str, Format] = {
    ".csv": "text",
    ".tsv": "text",
    ".txt": "text",
    ".dat": "text",
    ".asc": "text",
    ".parquet": "parquet",
    ".pq": "parquet",
    ".h5": "hdf5",
    ".hdf5": "hdf5",
    ".hdf": "hdf5",
    ".mat": "matlab",
    ".npy": "numpy",
    ".tdms": "tdms",
    ".mf4": "mdf",
    ".mdf": "mdf",
}


def open_table(path: Path, format_name: Format | None = None, text: Text | None = None) -> Table:
    """Open a source file for reading, by its format, or else by its suffix."""
    if not path.is_file():
        beside = [other.name for other in path.parent.iterdir()] if path.parent.is_dir() else []
        raise RecordingError("there is no such file", where=str(path), remedy=did_you_mean(path.name, beside))
    if path.stat().st_size == 0:
        raise RecordingError("the file is empty", where=str(path), remedy="export or copy it again")
    found = format_name or SUFFIXES.get(path.suffix.lower())
    if found is None:
        raise RecordingError(
            f"suffix '{path.suffix}' tells no format",
            where=str(path),
            remedy='give format = "text", "parquet", "hdf5", "tdms", "mdf", "matlab" or "numpy" in the mapping, '
            "or rename the file",
        )
    if found == "text":
        return TextTable(path, text or Text())
    return IsolatedTable(path, found)
