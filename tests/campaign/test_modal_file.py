"""Modal files: what is written is read back, and faults are told with their place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from kbs_process.campaign.modal_file import read_modal
from kbs_process.campaign.writing.modal_file import modal_text
from kbs_process.errors import ConfigError
from kbs_process.plant.laws import select
from kbs_process.plant.linear.modal import ModalTable, derive
from plant.plant_rigs import NOMINAL, two_axis


@pytest.fixture
def table() -> ModalTable:
    return derive(two_axis(), select(NOMINAL), "el", np.radians([70.0, 75.0, 80.0]), np.zeros(2))


def test_a_table_survives_its_file_to_the_last_bit(table: ModalTable, tmp_path: Path) -> None:
    path = tmp_path / "modes.toml"
    path.write_text(modal_text(table))
    back = read_modal(path, ("az", "el"))
    assert back.joint == "el"
    for one, other in zip(table.models, back.models, strict=True):
        for name in ("angle", "frequency", "frequency_sigma", "damping", "shape", "participation", "gravity"):
            assert np.array_equal(getattr(one, name), getattr(other, name)), name


@pytest.mark.parametrize(
    ("old", "new", "where", "said"),
    [
        ('joint = "el"', 'joint = "elevation"', ":6: joint", "there is no joint 'elevation'"),
        ("damping = ", "dampnig = ", "dampnig", "damping"),
        ("frequency_Hz = ", "frequency_Hz = -", "frequency_Hz", "-"),
        ("schema = 1", "schema = 2", "schema", "1"),
    ],
)
def test_faults_are_told_with_their_place(
    table: ModalTable, tmp_path: Path, old: str, new: str, where: str, said: str
) -> None:
    path = tmp_path / "modes.toml"
    path.write_text(modal_text(table).replace(old, new, 1))
    with pytest.raises(ConfigError) as caught:
        read_modal(path, ("az", "el"))
    assert where in str(caught.value)
    assert said in str(caught.value)


def test_poses_with_other_modes_are_refused(table: ModalTable, tmp_path: Path) -> None:
    path = tmp_path / "modes.toml"
    text = modal_text(table)
    last = text.rindex("[[pose.mode]]")
    path.write_text(text[:last])
    with pytest.raises(ConfigError, match="has 3 modes, the first pose 4"):
        read_modal(path, ("az", "el"))


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"the modal file does not exist"):
        read_modal(tmp_path / "no.toml", ("el",))
