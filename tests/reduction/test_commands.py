"""Commands from a table: radians, degrees by name, and degrees called radians."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from kbs_process.errors import RecordingError
from kbs_process.reduction.commands import of_table, read_commands


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


@pytest.mark.parametrize(
    ("t", "angle", "told"),
    [
        (np.arange(200) * 0.1, lambda t: 0.3 * np.sin(t), None),
        (np.arange(200) * 0.1, lambda t: np.clip(0.05 * (t - 5.0), 0.0, 0.4), None),  # starts and stops at once
        (np.arange(200) * 0.1, lambda t: 0.2 * np.floor(t / 5.0), None),  # steps and rests
        (np.array([0.0, 10.0, 40.0]), lambda t: 0.01 * t, None),
        (
            np.delete(np.arange(300), slice(50, 130)) * 0.1,
            lambda t: 0.3 * np.sin(t),
            "from 4.9 to 13 s: a straight line",
        ),
        (
            np.arange(200) * 0.1,
            lambda t: 0.3 * np.sin(t) + (t > 7.55),
            "wheel moves by 1.01 rad from 7.5 to 7.6 s: 10 times",
        ),
        (np.arange(200) * 0.1, lambda t: 0.3 * np.sin(t) + (t == 7.5), "from 7.4 to 7.5 s, and 1 times more"),
    ],
)
def test_holes_and_jumps_of_commands_are_told(tmp_path, t, angle, told):
    path = table(tmp_path, "t,wheel\n" + "".join(f"{x:.6g},{y:.6g}\n" for x, y in zip(t, angle(t), strict=True)))
    rig = SimpleNamespace(joint_names=("wheel",))
    slips = of_table(path, rig).slips
    assert len(slips) == (told is not None) and all(told in one for one in slips), slips
