"""HDF5: data sets of numbers by name, columns of a matrix "name[1]", fields of compounds "name[Fx]", "name[values][1]".

The conventions of netCDF are kept: what `scale_factor` and `add_offset` pack is unpacked, and what is called missing
(`_FillValue`, `missing_value`) or not valid (`valid_min`, `valid_max`, `valid_range`, of packed numbers) is NaN.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from kbs_process.recordings.formats import Format, Text
from kbs_process.recordings.tables import (
    UNPACKED,
    Cells,
    Column,
    Item,
    Series,
    SeriesTable,
    Slice,
    matrix_of,
    series_of,
    texts,
)

_NO_VARIABLE = "This is a netCDF dimension but not a netCDF variable"
# How many numbers attributes have, 0 for any.
_VALUES = {"scale_factor": 1, "add_offset": 1, "valid_min": 1, "valid_max": 1, "valid_range": 2}
_VALUES |= {"_FillValue": 0, "missing_value": 0}
_UNUSED = ("scale", "offset", "gain", "slope", "intercept")  # which no convention defines
# Classes of MATLAB; what others write has none.
_MATLAB_NUMBERS = re.compile("|double|single|logical|u?int(8|16|32|64)")
ELEMENTS = 1 << 16  # of an array of structures
_BLOCK_BYTES = 1 << 25  # of a matrix, or of records, read together for their columns
_UNWRITTEN = 1 << 26  # bytes of a data set that may be fill values alone


def read_hdf5(path: Path, _: Text) -> SeriesTable:
    """Open an HDF5 file; a data set's unit is its attribute "unit" or "units"."""
    return SeriesTable(path, datasets(path))


def datasets(path: Path, separator: str = "/", classes: bool = False) -> Iterator[Item]:
    """Yield the columns of a file; with `classes`, MATLAB says what its data sets are."""
    import h5py

    file = h5py.File(path, "r")
    found: list[tuple[str, Any]] = []
    file.visititems(lambda name, node: found.append((name, node)))
    sparse = tuple(f"{name}/" for name, node in found if "MATLAB_sparse" in node.attrs)
    for name, data in found:
        if not isinstance(data, h5py.Dataset) or (classes and name.startswith("#")):
            continue
        label = name.replace("/", separator)
        try:
            if why := _why_not(data, classes) or ("it is a sparse matrix" if name.startswith(sparse) else ""):
                yield f"{label}: {why}"
            elif classes and h5py.check_ref_dtype(data.dtype) is h5py.Reference:
                yield from _elements([file[one] for one in np.ravel(data[()])], label)
            elif not data.attrs.get("MATLAB_empty"):
                yield from _columns(data, label, classes)
        except (LookupError, OSError, RuntimeError, TypeError, ValueError):  # what h5py raises for odd types and damage
            yield f"{label}: its type, or an attribute of it, cannot be read: write it anew as numbers"


def _elements(fields: Sequence[Any], label: str) -> Iterator[Item]:
    """Yield the columns of one field of MATLAB's arrays of structures, of which each is a data set of its own."""
    import h5py

    name, _, field = label.rpartition(".")
    if all(isinstance(one, h5py.Dataset) and one.size == 1 and one.dtype.kind in "iufb" for one in fields):
        yield from series_of(np.concatenate([np.ravel(one[()]) for one in fields]), label)
        return
    for index, one in enumerate(fields, start=1):
        part = f"{name}({index}).{field}"
        if (
            why := _why_not(one, True)
            if isinstance(one, h5py.Dataset)
            else "it is a structure within several: save each"
        ):
            yield f"{part}: {why}"
        elif not one.attrs.get("MATLAB_empty"):
            yield from _columns(one, part, True)


def _why_not(data: Any, classes: bool) -> str:
    import h5py

    kind = data.attrs.get("MATLAB_class", b"") if classes else b""
    outside = [source.file_name for source in data.virtual_sources()] if data.is_virtual else []
    if data.external or any(name != "." for name in outside):
        return "its numbers lie in other files, which are not opened: copy them into this one"
    if _text(data.attrs.get("NAME", "")).startswith(_NO_VARIABLE):
        return "it is a dimension without values"
    if not _MATLAB_NUMBERS.fullmatch(_text(kind)):
        return f"it is a {_text(kind)}: save numbers"
    if data.size * data.dtype.itemsize > UNPACKED * data.id.get_storage_size() + _UNWRITTEN:
        return f"next to none of its {data.size} numbers was written"
    several = classes and h5py.check_ref_dtype(data.dtype) is h5py.Reference and data.parent.name != "/"
    if several and data.size > ELEMENTS:
        return f"it is a field of {data.size} structures: save it as numbers"
    if data.dtype.kind == "O" and not several and not (h5py.check_string_dtype(data.dtype) and data.ndim == 1):
        return "it has no numbers"
    return ""


def _columns(data: Any, name: str, classes: bool) -> Iterator[Item]:
    unit = _text(data.attrs.get("units", "")) if "unit" not in data.attrs else _text(data.attrs["unit"])
    if data.dtype.names and data.ndim == 1:
        records = _Cached(data)
        for member in data.dtype.names:
            label, kind = f"{name}[{member}]", data.dtype[member]
            cells = _Field(records, member, kind.base, (len(data), *kind.shape))
            if len(kind.shape) == 1:
                yield from matrix_of(cells, label, unit, upright=True)
            else:
                yield from series_of(cells, label, unit)
        return
    if data.dtype.kind in "OS" and data.ndim == 1:
        yield Series(Column(name, unit), len(data), _words(data))
        return
    if odd := next(filter(None, (_odd(data, *one) for one in _VALUES.items())), ""):
        yield f"{name}: its attribute {odd}"
        return
    if unused := [key for key in _UNUSED if key in data.attrs]:
        yield Counter({f"attributes of {name} change no number ({', '.join(unused)}): a mapping can": len(unused)})
    packing = _Packing.of(data) if data.dtype.kind in "iuf" else None
    change = None if packing is None else packing.unpacked
    if data.ndim == 2:  # MATLAB's are transposed: of a square one, too
        yield from matrix_of(_Cached(data), name, unit, change, upright=data.shape[0] >= data.shape[1] + classes)
    else:
        yield from series_of(_Cached(data), name, unit, change)


def _odd(data: Any, attribute: str, count: int) -> str:
    """Say what is wrong with an attribute that means numbers, nothing where it is absent or well."""
    if attribute not in data.attrs:
        return ""
    values = np.asarray(data.attrs[attribute])
    if values.dtype.kind not in "iufb":
        return f"{attribute} is no number"
    if count and values.size != count:
        return f"{attribute} has {values.size} values, not {count}"
    spoiled = attribute in ("scale_factor", "add_offset") and not np.isfinite(values).all()
    return f"{attribute} is {values.item()}" if spoiled or (attribute == "scale_factor" and not values.all()) else ""


def _words(data: Any) -> Slice:
    def read(first: int, count: int) -> Cells:
        return texts(_text(one) for one in data[first : first + count].tolist())

    return read


@dataclass(slots=True)
class _Cached:
    """A data set of numbers or records, whose columns are read one after the other: the stretch read last is kept."""

    data: Any
    at: tuple[int, int] = (0, 0)
    block: Any = None

    @property
    def dtype(self) -> Any:
        return self.data.dtype

    @property
    def shape(self) -> tuple[int, ...]:
        return self.data.shape  # type: ignore[no-any-return]

    @property
    def ndim(self) -> int:
        return len(self.shape)

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, key: Any) -> Cells:
        keys = key if isinstance(key, tuple) else (key,)
        axis = next(place for place, one in enumerate(keys) if isinstance(one, slice))
        block = self.stretch(keys[axis], axis)
        column = [one for one in keys if not isinstance(one, slice)]
        return np.asarray(self.data[key] if block is None else block[(slice(None), *column)])

    def stretch(self, rows: slice, axis: int = 0) -> Any:
        """Return all of some rows, which run along an axis; None where they are too many numbers to be held.

        Numbers that were compressed together are unpacked together, and once.
        """
        first, end, _ = rows.indices(self.shape[axis])
        if self.block is None or not self.at[0] <= first <= end <= self.at[1]:
            together = self.data.chunks if self.data.id.get_create_plist().get_nfilters() else None
            high = together[axis] if together else 1
            start, stop = first - first % high, min(-(-end // high) * high, self.shape[axis])
            held = self.data.dtype.itemsize * (stop - start) * (self.data.size // max(self.shape[axis], 1))
            if held > max(_BLOCK_BYTES, 2 * self.data.dtype.itemsize * math.prod(together or ())):
                return None
            self.block = self.data[start:stop] if axis == 0 else self.data[:, start:stop].T
            self.at = (start, stop)
        return self.block[first - self.at[0] : end - self.at[0]]


@dataclass(frozen=True, slots=True)
class _Field:
    """A field of the records of a data set, of one number or several."""

    records: _Cached
    name: str
    dtype: Any
    shape: tuple[int, ...]

    @property
    def ndim(self) -> int:
        return len(self.shape)

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, key: Any) -> Cells:
        rows, *column = key if isinstance(key, tuple) else (key,)
        block = self.records.stretch(rows)
        field = self.records.data.fields(self.name)[rows] if block is None else block[self.name]
        return np.asarray(field)[(slice(None), *column)]


@dataclass(frozen=True, slots=True)
class _Packing:
    """How numbers are packed, and which mean that there is none."""

    scale: float
    offset: float
    missing: tuple[float, ...]
    low: float
    high: float
    unsigned: bool
    packed: bool = field(default=False)

    @classmethod
    def of(cls, data: Any) -> _Packing | None:
        """Return the packing that a data set's attributes state, None where they state none.

        What was never written is missing too, where the file says what stands for it, and that is not 0.
        """
        import h5py

        attributes: Mapping[str, Any] = data.attrs
        names = ("scale_factor", "add_offset", "_FillValue", "missing_value", "valid_min", "valid_max", "valid_range")
        given = {name: np.ravel(attributes[name]).astype(np.float64) for name in names if name in attributes}
        unsigned = _text(attributes.get("_Unsigned", "")).lower() == "true"
        chosen = data.id.get_create_plist().fill_value_defined() == h5py.h5d.FILL_VALUE_USER_DEFINED
        if chosen and data.fillvalue:
            given.setdefault("_FillValue", np.array([data.fillvalue], dtype=np.float64))
        if not given and not unsigned:
            return None
        lowest, highest = given.get("valid_range", np.array([-np.inf, np.inf]))
        missing = np.concatenate([given.get("_FillValue", np.empty(0)), given.get("missing_value", np.empty(0))])
        return cls(
            scale=float(given.get("scale_factor", np.ones(1))[0]),
            offset=float(given.get("add_offset", np.zeros(1))[0]),
            missing=tuple(missing.tolist()),
            low=float(given.get("valid_min", np.array([lowest]))[0]),
            high=float(given.get("valid_max", np.array([highest]))[0]),
            unsigned=unsigned,
            packed="scale_factor" in given or "add_offset" in given,
        )

    def unpacked(self, cells: Cells) -> Cells:
        """Return the numbers that were packed, NaN where there is none."""
        if self.unsigned and cells.dtype.kind == "i":
            cells = cells.view(cells.dtype.str.replace("i", "u"))
        # As the cells have them: of fewer digits, or without a sign.
        kind = cells.dtype if cells.dtype.kind == "f" else np.float64
        missing = (
            np.array(self.missing) % 2.0 ** (8 * cells.itemsize) if self.unsigned else np.array(self.missing, kind)
        )
        lacking = np.isin(cells, missing) | (cells < self.low) | (cells > self.high)
        if not self.packed and not lacking.any():
            return cells
        values = cells.astype(np.float64)
        values = values * self.scale + self.offset if self.packed else values
        return np.where(lacking, np.nan, values)


def _text(value: Any) -> str:
    value = value.item() if isinstance(value, np.ndarray) and value.size == 1 else value
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


FORMAT = Format(suffixes=(".h5", ".hdf5", ".hdf"), read=read_hdf5, library="h5py")
