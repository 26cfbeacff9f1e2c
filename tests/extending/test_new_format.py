"""A format is one file in recordings/formats: nothing else is edited."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from extending.scratch import copy_package, run_copy
from studies.convert.importer_files import MAPPING, read_back, signals, write_mapping

BLOCKS = '''"""Blocks: a line of names, then doubles, a row after the other."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kbs_process.recordings.formats import Format, Text
from kbs_process.recordings.tables import SeriesTable, series_of


def read_blocks(path: Path, _: Text) -> SeriesTable:
    head, _, data = path.read_bytes().partition(b"\\n")
    names = head.decode().split()
    rows = np.frombuffer(data).reshape(-1, len(names))
    return SeriesTable(path, (one for name, column in zip(names, rows.T) for one in series_of(column, name)))


FORMAT = Format(suffixes=(".blk",), read=read_blocks)
'''


def test_a_format_is_one_file(tmp_path: Path) -> None:
    package = copy_package(tmp_path)
    (package / "recordings" / "formats" / "blocks.py").write_text(BLOCKS)
    columns = signals(300)
    rows = np.column_stack(list(columns.values()))
    (tmp_path / "run.blk").write_bytes(" ".join(columns).encode() + b"\n" + rows.tobytes())

    assert " Fz\n" in run_copy(tmp_path, "import", "--describe", "run.blk")
    mapping = write_mapping(tmp_path, "run.blk", 'format = "blocks"\n' + MAPPING)
    run_copy(tmp_path, "import", "--quiet", str(mapping), "run.blk", "campaign")
    values = read_back(tmp_path / "campaign", "turn_1")["wrench"][1]
    expected = np.column_stack([columns[name] for name in ("Fx", "Fy", "Fz")])
    np.testing.assert_array_equal(values.view(np.int64), expected.view(np.int64))
