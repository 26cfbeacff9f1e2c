"""Parquet: columns by name, read a record batch at a time; a column's unit is its field's metadata "unit"."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kbs_process.recordings.formats import Format, Text
from kbs_process.recordings.tables import CHUNK_ROWS, Cells, Column


class ParquetTable:
    """A Parquet file."""

    def __init__(self, path: Path, _: Text) -> None:
        import pyarrow.parquet as pq

        self.path = path
        self._file = pq.ParquetFile(path, page_checksum_verification=True)
        self.columns = tuple(Column(field.name, _unit(field)) for field in self._file.schema_arrow)

    def chunks(self, names: Sequence[str]) -> Iterator[tuple[Cells, ...]]:
        for batch in self._file.iter_batches(batch_size=CHUNK_ROWS, columns=list(dict.fromkeys(names))):
            yield tuple(_cells(batch.column(name)) for name in names)


def _unit(field: Any) -> str:
    unit: bytes = (field.metadata or {}).get(b"unit", b"")
    return unit.decode("utf-8", "replace")


def _cells(array: Any) -> Cells:
    """Return a column of a batch; what is absent becomes NaN, or "" in a text."""
    import pyarrow as pa

    if pa.types.is_timestamp(array.type):
        return np.asarray(array.cast(pa.timestamp("ns", array.type.tz)).to_numpy(zero_copy_only=False))
    if pa.types.is_integer(array.type) and array.null_count == 0:
        return np.asarray(array.to_numpy(zero_copy_only=False))
    if pa.types.is_integer(array.type) or pa.types.is_floating(array.type) or pa.types.is_decimal(array.type):
        return np.asarray(array.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False))
    return np.array(["" if cell is None else str(cell) for cell in array.to_pylist()], dtype=np.str_)


FORMAT = Format(suffixes=(".parquet", ".pq"), read=ParquetTable)
