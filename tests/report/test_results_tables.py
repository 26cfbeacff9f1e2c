"""Tables of a results folder, as a user reads them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from kbs_process.errors import OutputError
from kbs_process.report.tables import Tables
from kbs_process.results.tables import read_table, write_table


def test_a_table_is_a_data_frame_with_units(tmp_path: Path) -> None:
    path = tmp_path / "tables" / "bands" / "run.parquet"
    columns = {"t": np.array([0.0, 0.05]), "valid": np.array([True, False]), "Tx.measured": np.array([1e-3, np.nan])}
    units = {"t": "s", "Tx.measured": "N m"}
    write_table(path, columns, units, frame="T", history=("raw", "cut"), recording="run")
    table = read_table(path)
    assert (table.index.name, *table) == ("t", "valid", "Tx.measured")
    for name, values in table.reset_index().items():
        np.testing.assert_array_equal(values, columns[str(name)])
    assert table.attrs == {"units": units, "frame": "T", "history": ["raw", "cut"], "recording": "run"}


@pytest.mark.parametrize("content", [b"", b"PAR1 and no more"])
def test_what_is_no_table_is_named_with_a_remedy(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "run.parquet"
    path.write_bytes(content)
    with pytest.raises(OutputError, match=r"run\.parquet.*not a readable table") as caught:
        read_table(path)
    assert caught.value.remedy


def test_tables_of_words_and_tables_without_rows(tmp_path: Path) -> None:
    (tmp_path / "tables" / "bands").mkdir(parents=True)
    path = tmp_path / "tables" / "bands" / "run.lt1Hz.parquet"
    write_table(path, {"t": np.empty(0), "Tx.measured": np.empty(0)}, {})
    assert Tables(tmp_path).band("run", "lt1Hz", "T") is None
    pq.write_table(pa.table({"t": ["x"]}), path)
    with pytest.raises(OutputError, match="its columns are no numbers"):
        Tables(tmp_path).band("run", "lt1Hz", "T")
