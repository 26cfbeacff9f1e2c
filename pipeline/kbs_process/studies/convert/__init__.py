"""Files in the field's formats (CSV, Parquet, HDF5, TDMS, MDF4) into a campaign's folder.

A mapping (a TOML file, schemas/import.schema.json) says which columns are which channels, in which units, and
which files become which recordings; presets for public recordings come with the package. What these functions
need is imported when they are called: the child processes that read binary files start without it.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from kbs_process.progress import Progress

PRESETS = Path(__file__).parent / "presets"


def import_recordings(
    mapping: Path | str,
    source: Path,
    target: Path,
    *,
    progress: Progress | None = None,
    notice: Callable[[str], None] | None = None,
) -> Path:
    """Convert source files into a new campaign folder and return it.

    `mapping` is the path of a mapping or the name of a preset; `source` the folder of the files that it names,
    or, where it names one, that file; `target` the folder to make, which must not exist, or be empty. It
    appears whole or not at all. `notice` is given one line for each thing that is wrong with the files but
    not fatal: cells that are no number, time stamps that repeat or go back.

    Raises ConfigError (mapping or campaign), RecordingError (source files), OutputError (target).
    """
    from kbs_process.studies.convert.run import convert

    return convert(mapping, source, target, progress=progress, notice=notice)


def describe(source: Path) -> str:
    """Return the beginning of a mapping for a source file; its comments list the columns with their ranges.

    Raises RecordingError where the file cannot be read.
    """
    from kbs_process.studies.convert.inspection import inspect

    return inspect(source)


def preset_names() -> tuple[str, ...]:
    """Return the names of the mappings that come with the package."""
    return tuple(sorted(path.stem for path in PRESETS.glob("*.toml")))
