"""Which format a foreign file has, and the file opened."""

from __future__ import annotations

from pathlib import Path

from kbs_process.errors import RecordingError, did_you_mean
from kbs_process.files import regular
from kbs_process.recordings.formats import Text, formats
from kbs_process.recordings.isolated import IsolatedTable
from kbs_process.recordings.tables import Table


def open_table(path: Path, name: str | None = None, text: Text | None = None) -> Table:
    """Open a source file for reading, by its format's name, or else by its suffix."""
    try:
        regular(path)
    except FileNotFoundError:
        beside = [other.name for other in path.parent.iterdir()] if path.parent.is_dir() else []
        raise RecordingError("there is no such file", where=str(path), remedy=did_you_mean(path.name, beside)) from None
    except OSError as error:
        raise RecordingError(f"cannot be read: {error.strerror}", where=str(path), remedy="give a file") from error
    if path.stat().st_size == 0:
        raise RecordingError("the file is empty", where=str(path), remedy="export or copy it again")
    suffix = path.suffix.lower()
    found = name or next((name for name, one in formats().items() if suffix in one.suffixes), None)
    if found is None:
        *others, last = (f'"{name}"' for name in formats())
        raise RecordingError(
            f"suffix '{path.suffix}' tells no format",
            where=str(path),
            remedy=f"give format = {', '.join(others)} or {last} in the mapping, or rename the file",
        )
    entry = formats()[found]
    return IsolatedTable(path, found, entry) if entry.isolated else entry.read(path, text or Text())
