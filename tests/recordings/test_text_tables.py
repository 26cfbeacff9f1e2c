"""What is a number, a cell and a row of delimited text, and what is none; nothing is guessed."""

from __future__ import annotations

import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kbs_process.errors import RecordingError
from kbs_process.recordings.formats import Text
from kbs_process.recordings.formats.text import TextTable
from kbs_process.studies.convert.clock import numbers

NAN = float("nan")


def table(folder: Path, content: str | bytes, **options: Any) -> TextTable:
    path = folder / "a.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return TextTable(path, Text(**options))


def column(one: TextTable, name: str) -> list[float]:
    return np.concatenate([numbers(cells) for (cells,) in one.chunks([name])]).tolist()


@pytest.mark.parametrize("row", ["0.5,9,9", "0.5,9,9,9,9", '0.5,9,"9', "0.5;9;9;9", "0.5,9,9,\0", "text"])
def test_a_line_with_more_or_fewer_cells_is_no_row(tmp_path: Path, row: str) -> None:
    found = table(tmp_path, f"t,a,b,c\n0,1,2,3\n{row}\n1,4,5,6\n")
    assert [column(found, name) for name in "tabc"] == [[0, 1], [1, 4], [2, 5], [3, 6]]
    assert found.odd == {"lines are no rows of 4 cells, left out (the first is line 3)": 1}


@pytest.mark.parametrize(
    "content", ["t,a\n0,1,\n1,2,\n", "t,a,\n0,1\n1,2\n", "t,a,\n0,1,\n1,2,\n", "t,a\n0,1\n1,2, , \n"]
)
def test_delimiters_at_the_end_make_no_columns_that_shift(tmp_path: Path, content: str) -> None:
    found = table(tmp_path, content)
    assert (column(found, "t"), column(found, "a")) == ([0, 1], [1, 2])
    assert not found.odd


@pytest.mark.parametrize("cell", ["1_2", "0x1F", "1.2.3", "1,2", "1e", "--1", "\u0661", "1 2", "overload", "9_9"])
def test_what_is_no_number(tmp_path: Path, cell: str) -> None:
    assert column(table(tmp_path, f't,a\n0,1\n1,"{cell}"\n'), "a")[0] == 1
    assert np.isnan(column(table(tmp_path, f't,a\n0,1\n1,"{cell}"\n'), "a")[1])


@pytest.mark.parametrize("cell", ["1.5e2", "+150", "150.", " 150 ", "1.5E+02"])
def test_what_is_a_number(tmp_path: Path, cell: str) -> None:
    assert column(table(tmp_path, f"t,a\n0,{cell}\n1,text\n"), "a")[0] == 150


def test_a_point_among_decimal_commas_is_not_guessed(tmp_path: Path) -> None:
    content = "t;a\n0,5;-50.014\n1,5;-1.050.014,5\n2,5;1,5\n3,5;12.34\n"
    with pytest.raises(RecordingError, match=r"'-50\.014' in column 'a' has a point") as caught:
        column(table(tmp_path, content, decimal=","), "a")
    assert "thousands" in caught.value.remedy
    found = column(table(tmp_path, content, decimal=",", thousands="."), "a")
    np.testing.assert_array_equal(found, [-50014, -1050014.5, 1.5, NAN])
    with pytest.raises(RecordingError, match="cannot part thousands too"):
        table(tmp_path, content, decimal=",", thousands=",")


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_encodings_and_ends_of_lines(tmp_path: Path, encoding: str, end: str) -> None:
    found = table(tmp_path, end.join(["t,Kraft \u00b0", "0,1", "", "1,2"]).encode(encoding))
    assert column(found, "Kraft \u00b0") == [1, 2]


def test_names_that_come_again_are_all_numbered(tmp_path: Path) -> None:
    found = table(tmp_path, "t,Fx,Fx,Fx (2)\n0,1,9,5\n")
    assert [one.name for one in found.columns] == ["t", "Fx (1)", "Fx (3)", "Fx (2)"]
    assert column(found, "Fx (2)") == [5]


def test_a_line_of_names_that_fits_no_row_is_refused(tmp_path: Path) -> None:
    for content in ("a b c\nrow1 1 2 3\nrow2 4 5 6\n", "t,a,b\n0,1\n1,2\n"):
        with pytest.raises(RecordingError, match="which is whose"):
            table(tmp_path, content)


def test_sections_of_a_log_are_taken_by_their_lines(tmp_path: Path) -> None:
    section = "Begins at 9, with words\nt,a,b\nINFO: settling\n" + "".join(f"{i},{i},0\n" for i in range(5)) + "\nEnd\n"
    found = table(tmp_path, "Log 2.5\n\n" + section + section, skip_rows=3, rows=5, comment="INFO")
    assert [one.name for one in found.columns] == ["t", "a", "b"]
    assert column(found, "t") == [0, 1, 2, 3, 4]


def test_sections_below_repeated_names_are_read_one_by_one(tmp_path: Path) -> None:
    log = "Log 2.5\n" + "".join(
        "Begins\nt,a,b\ns,V,V\nINFO: settling, now\n"
        + "".join(f"{t},{k},{k}\n" for t in range(rows))
        + "End, of a section, it is, here\n\n"
        for k, rows in ((1, 6), (5, 5), (7, 5))
    )
    options = {"skip_rows": 2, "units_row": True}
    found = [table(tmp_path, log, section=k, **options) for k in (1, 2, 3)]
    assert [column(one, "t") for one in found] == [[*range(6)], [*range(5)], [*range(5)]]
    assert [column(one, "b")[0] for one in found] == [1, 5, 7]
    whole = table(tmp_path, log, **options)
    assert whole.sections() == 3 and column(whole, "t") == [*range(6), *range(5), *range(5)]
    assert next(count for what, count in whole.odd.items() if "section = 1, 2" in what) == 2
    with pytest.raises(RecordingError, match="there is no section 4: its line of names is there 3 times"):
        column(table(tmp_path, log, section=4, **options), "t")


def test_a_long_cell_costs_what_it_is_long(tmp_path: Path) -> None:
    found = table(tmp_path, "t,a\n" + "0,1\n" * 2000 + "1," + "x" * 60_000 + "\n")
    tracemalloc.start()
    assert np.isnan(column(found, "a")[-1])
    assert tracemalloc.get_traced_memory()[1] < 30e6
    tracemalloc.stop()


def test_many_columns_take_one_pass(tmp_path: Path) -> None:
    names = [f"c{i}" for i in range(20_000)]
    found = table(tmp_path, ",".join(names) + "\n" + ",".join("1" for _ in names) + "\n")
    (cells,) = found.chunks(names)
    assert len(cells) == len(names)


def test_a_line_of_units_that_nobody_told_of(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time,Ty\ns,N mm\n0.0,1.0\n0.1,2.0\n")
    with pytest.raises(RecordingError, match=r"line 2 holds no number: s, N mm[\s\S]*units_row = true"):
        TextTable(tmp_path / "a.csv", Text())
    assert [column.unit for column in TextTable(tmp_path / "a.csv", Text(units_row=True)).columns] == ["s", "N mm"]
