"""Foreign formats, one file each, found by being in this folder: a new one is one file more, and no line elsewhere.

The file is named as mappings name the format, and declares a `FORMAT`: the suffixes of its files and how to open one as
named columns. It imports at its top nothing that takes long, as all are imported to know their suffixes. `numpy` is the
shortest to start from.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Literal

import msgspec

from kbs_process.recordings.tables import Table


class Text(msgspec.Struct, frozen=True):
    """How delimited text is written; None is found from the first lines."""

    delimiter: str | None = None
    header: bool | None = None
    units_row: bool = False
    skip_rows: int = 0
    rows: int | None = None
    section: int | None = None  # of a log that repeats its line of names, counted from 1
    decimal: Literal[".", ","] = "."
    thousands: str | None = None
    comment: str | None = None
    encoding: str = "utf-8-sig"


@dataclass(frozen=True, slots=True)
class Format:
    """What a format's file declares."""

    suffixes: tuple[str, ...]  # of its files, in lower case
    read: Callable[[Path, Text], Table]  # opens a file; of the text's options only text makes use
    library: str = ""  # the package that reads it, where it may be absent
    isolated: bool = True  # read in a child process, as a damaged binary file may end the interpreter


@cache
def formats() -> Mapping[str, Format]:
    """Return every format by its name, in alphabetical order."""
    return {module.name: format_named(module.name) for module in iter_modules(__path__)}


def format_named(name: str) -> Format:
    """Return one of the formats without importing the others."""
    found: Format = import_module(f"{__name__}.{name}").FORMAT
    return found
