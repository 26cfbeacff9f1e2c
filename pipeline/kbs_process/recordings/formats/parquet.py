"""Parquet: columns by name, read a record batch at a time; a column's unit is its field's metadata "unit"."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kbs_process.recordings.formats import Format, Text
from kbs_process.recordings.tables import Cells, Column, rows_a_piece, texts


class ParquetTable:
    """A Parquet file."""

    def __init__(self, path: Path, _: Text) -> None:
        import pyarrow.parquet as pq

        self.path = path
        self.odd = Counter[str]()
        self._file = pq.ParquetFile(path, page_checksum_verification=True)
        fields = list(self._file.schema_arrow)
        counts = Counter(field.name for field in fields)
        reasons = {field.name: _why_not(field, counts) for field in fields}
        self.left_out = tuple(f"{name}: {why}" for name, why in reasons.items() if why)
        self.columns = tuple(Column(field.name, _unit(field)) for field in fields if not reasons[field.name])

    def chunks(self, names: Sequence[str]) -> Iterator[tuple[Cells, ...]]:
        rows, wanted = rows_a_piece(len(names)), list(dict.fromkeys(names))
        for batch in self._file.iter_batches(batch_size=rows, columns=wanted):
            yield tuple(_cells(batch.column(name)) for name in names)


def _why_not(field: Any, counts: Counter[str]) -> str:
    import pyarrow as pa

    if counts[field.name] > 1:
        return "several columns are called so: rename them"
    if pa.types.is_nested(field.type):
        return f"it holds {field.type}: write each of its parts as a column"
    return "a '.' in its name parts columns in Parquet: rename it" if "." in field.name else ""


def _unit(field: Any) -> str:
    import pyarrow as pa

    unit: bytes = (field.metadata or {}).get(b"unit", b"s" if pa.types.is_duration(field.type) else b"")
    return unit.decode("utf-8", "replace")


def _cells(array: Any) -> Cells:
    """Return a column of a batch; what is absent becomes NaN, or "" in a text."""
    import pyarrow as pa

    if pa.types.is_dictionary(array.type):
        array = array.dictionary_decode()
    kind = array.type
    if pa.types.is_timestamp(kind):
        return np.asarray(array.cast(pa.timestamp("ns", kind.tz)).to_numpy(zero_copy_only=False))
    if pa.types.is_date(kind):
        return np.asarray(array.cast(pa.timestamp("ns")).to_numpy(zero_copy_only=False))
    if pa.types.is_duration(kind):
        ns = array.cast(pa.duration("ns")).to_numpy(zero_copy_only=False)
        return np.where(np.isnat(ns), np.nan, ns.astype(np.int64) / 1e9)
    if pa.types.is_floating(kind) or (pa.types.is_integer(kind) and array.null_count == 0):
        return np.asarray(array.to_numpy(zero_copy_only=False))
    if pa.types.is_decimal(kind):
        return np.array([float("nan") if cell is None else float(cell) for cell in array.to_pylist()])
    if pa.types.is_integer(kind) or pa.types.is_boolean(kind):
        array = array.cast(pa.int8()) if pa.types.is_boolean(kind) else array
        return np.asarray(array.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False))
    return texts("" if cell is None else str(cell) for cell in array.to_pylist())


FORMAT = Format(suffixes=(".parquet", ".pq"), read=ParquetTable)
