"""What every results.json has: its records' base, verdict, notices and provenance, and how it is stored.

Units are SI and part of a field's name, or stand beside the value in `unit`. A number that could not
be determined is None (null), never NaN. Every `sigma` is one standard deviation.
"""

from __future__ import annotations

from collections.abc import Sized
from pathlib import Path
from typing import Any, Literal, TypeVar

import msgspec

from kbs_process.errors import OutputError
from kbs_process.files import regular
from kbs_process.results.versions import VERSION, upgraded

FILE = "results.json"
LARGEST = 1e150

Status = Literal["pass", "fail", "undecided", "none"]
Severity = Literal["info", "warning", "error"]


class Record(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An immutable entry of results.json; an unknown key is an error."""


def check_lengths(first: Sized, *others: Sized) -> None:
    """Raise ValueError for lists that belong together, entry by entry, and are not as long as each other."""
    lengths = sorted({len(one) for one in (first, *others)})
    if len(lengths) > 1:
        raise ValueError(f"lists that belong together have {' and '.join(map(str, lengths))} entries")


class Conclusion(Record, frozen=True, kw_only=True):
    """The campaign's verdict ("none": it has no requirement), in a word and in a sentence."""

    status: Status
    sentence: str


class Notice(Record, frozen=True, kw_only=True):
    """Something that a reader of the verdict must know, and what can be done about it."""

    severity: Severity
    what: str
    where: str = ""
    remedy: str = ""


class Check(Record, frozen=True, kw_only=True):
    """A named check on a fit."""

    name: str
    ok: bool
    detail: str = ""


class Constant(Record, frozen=True, kw_only=True):
    """A constant that the processing used; arrays are printed as text."""

    name: str
    value: float | str
    unit: str
    sigma: float | str | None
    source: str


class InputFile(Record, frozen=True, kw_only=True):
    """A file that the results depend on."""

    file: str
    sha256: str


class Provenance(Record, frozen=True, kw_only=True):
    """What made these results."""

    version: str
    python: str
    libraries: dict[str, str]
    platform: str
    command: str
    commit: str = ""  # of the code; "+": its files differ from it
    source: str = ""  # SHA-256 of the code's files, where no commit says what is in them
    inputs: tuple[InputFile, ...] = ()


class ResultsFile(Record, frozen=True, kw_only=True):
    """What every kind of results.json has; each kind adds its `kind` and all else that it says."""

    schema: Literal[2] = VERSION
    verdict: Conclusion
    provenance: Provenance
    warnings: tuple[Notice, ...] = ()


class _Form(msgspec.Struct, frozen=True):
    """The keys that say how to read the others."""

    kind: str = "correlation"
    schema: int = 1


R = TypeVar("R", bound=msgspec.Struct)


def _plain(value: object) -> object:
    """A number of numpy's as one of Python's."""
    import numpy as np  # not before something asks for it: `--help` answers at once

    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"no results hold a {type(value).__name__}")


def encode(results: Record) -> bytes:
    """Return results.json: indented, the same bytes for the same results; NaN and infinities become null."""
    compact = msgspec.json.encode(results, order="deterministic", enc_hook=_plain)
    return msgspec.json.format(compact, indent=2) + b"\n"


def decode(content: bytes, record: type[R], where: str = FILE) -> R:
    """Return the results in `content`, of this or a former version, or say which field is wrong."""
    try:
        current = msgspec.json.decode(content, type=_Form).schema == VERSION
        stored = msgspec.json.decode(content)
        _check_numbers(stored)
        return msgspec.convert(stored if current else upgraded(stored), record)
    except (msgspec.ValidationError, msgspec.DecodeError) as error:
        raise OutputError(
            f"not a results file of this version: {error}",
            where=where,
            remedy="process the campaign again: kbs-process CAMPAIGN",
        ) from None


def _check_numbers(stored: Any, path: str = "$") -> None:
    """Refuse numbers whose square no number holds, and negative sigmas: none was computed, and none can be drawn."""
    if isinstance(stored, dict | list):
        for key, value in stored.items() if isinstance(stored, dict) else enumerate(stored):
            _check_numbers(value, f"{path}.{key}" if isinstance(stored, dict) else f"{path}[{key}]")
    elif isinstance(stored, int | float) and abs(stored) > LARGEST:
        raise msgspec.ValidationError(f"no result is beyond {LARGEST:g} - at `{path}`")
    elif path.endswith(".sigma") and isinstance(stored, int | float) and stored < 0:
        raise msgspec.ValidationError(f"no sigma is negative - at `{path}`")


def load(folder: Path, record: type[R]) -> R:
    """Return the results of a results folder."""
    return decode(_content(folder), record, str(folder / FILE))


def kind_of(folder: Path) -> str:
    """Return what kind of results a folder holds."""
    return decode(_content(folder), _Form, str(folder / FILE)).kind


def schema_of(record: type[Record], title: str) -> dict[str, Any]:
    """Return the JSON Schema of a kind of results.json."""
    (entry,), definitions = msgspec.json.schema_components((record,), ref_template="#/$defs/{name}")
    whole = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": title, **entry, "$defs": definitions}
    return msgspec.json.decode(msgspec.json.encode(whole, enc_hook=_plain), type=dict[str, Any])  # as a file holds it


def _content(folder: Path) -> bytes:
    path = folder / FILE
    try:
        return regular(path).read_bytes()
    except FileNotFoundError:
        raise OutputError(
            "no results here",
            where=str(path),
            remedy="give a results folder (results/NAME), or process the campaign first",
        ) from None
