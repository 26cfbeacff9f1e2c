"""Commands from a table: radians, degrees by name, and degrees called radians."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from kbs_process.errors import RecordingError
from kbs_process.reduction.commands import read_commands


def table(folder: Path, text: str) -> Path:
    path = folder / "slew.csv"
    path.write_text(text)
    return path


def test_degrees_by_name(tmp_path: Path) -> None:
    path = table(tmp_path, "t,az,el.deg\n0,0,70\n1,0.1,71\n")
    schedule = read_commands(path, ("az", "el"))
    assert schedule.position == pytest.approx(np.array([[0.0, np.radians(70)], [0.1, np.radians(71)]]))
    assert schedule.rate[0] == pytest.approx([0.1, np.radians(1)])


def test_degrees_called_radians(tmp_path: Path) -> None:
    path = table(tmp_path, "t,az,el\n0,0,70\n1,0,71\n")
    with pytest.raises(RecordingError, match=r"call the column 'el\.deg'"):
        read_commands(path, ("az", "el"))


def test_more_than_a_turn_from_a_start_within_one(tmp_path: Path) -> None:
    path = table(tmp_path, "t,wheel\n0,0\n1,7\n2,14\n")
    assert read_commands(path, ("wheel",)).position[:, 0] == pytest.approx([0.0, 7.0, 14.0])


def test_commands_of_decades(tmp_path: Path) -> None:
    path = table(tmp_path, "t,wheel\n0,0\n1e9,0\n")
    with pytest.raises(RecordingError, match=r"'t' lasts 1e\+09 s[\s\S]*seconds"):
        read_commands(path, ("wheel",))
