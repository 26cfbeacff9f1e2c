"""Nastran's f06: the file in data/ was written by pyNastran 1.4.1 from the modes of the rig at 70 deg."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from kbs_process.errors import RecordingError
from kbs_process.plant.laws import select
from kbs_process.plant.linear.modal import ModalModel, derive
from kbs_process.signals.records import Array
from kbs_process.studies.modal.nastran import read_f06
from plant.plant_rigs import NOMINAL, two_axis

F06 = Path(__file__).parent / "data" / "pose70.f06"


def test_an_f06_gives_the_modes_it_was_made_of() -> None:
    found = read_f06(F06, np.radians(70.0), interface=100, ground=[101], damping=0.01)
    made = derive(two_axis(), select(NOMINAL), "el", np.radians([70.0]), np.zeros(2)).models[0]
    assert np.allclose(found.frequency, made.frequency, rtol=1e-5)
    assert np.allclose(found.shape, made.shape, atol=2e-6)
    assert np.allclose(found.participation, made.participation, atol=2e-5)
    f = np.array([1.0, 2.0, 5.0])
    weightless = made.transfer(f) - np.einsum("ik,nk,jk->nij", made.gravity, _answer(made, f), made.shape)
    assert np.allclose(np.abs(found.transfer(f))[:, 3:, 3:], np.abs(weightless)[:, 3:, 3:], atol=0.02)


def _answer(model: ModalModel, f: Array) -> Array:
    w, wk = 2 * np.pi * f[:, None], 2 * np.pi * model.frequency
    return 1.0 / (wk**2 - w**2 + 2j * model.damping * wk * w)


def test_modes_of_another_norm_come_out_of_unit_mass(tmp_path: Path) -> None:
    lines = []
    for line in F06.read_text().splitlines():
        words = line.split()
        if len(words) == 7 and words[0].isdigit() and words[1].isdigit():
            line = line.replace("1.000000E+00", "4.000000E+00")
        lines.append(line)
    path = tmp_path / "scaled.f06"
    path.write_text("\n".join(lines))
    plain = read_f06(F06, 0.0, interface=100, ground=[101], damping=0.01)
    scaled = read_f06(path, 0.0, interface=100, ground=[101], damping=0.01)
    assert np.allclose(scaled.shape, 0.5 * plain.shape)
    assert np.allclose(scaled.participation, 0.5 * plain.participation)


def test_missing_points_and_tables_are_told(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"grid point 7 has 0 rows of eigenvectors, for 4 modes"):
        read_f06(F06, 0.0, interface=7, ground=[101], damping=0.01)
    with pytest.raises(RecordingError, match=r"SPCFORCES"):
        read_f06(F06, 0.0, interface=100, ground=[7], damping=0.01)
    empty = tmp_path / "empty.f06"
    empty.write_text("nothing\n")
    with pytest.raises(RecordingError, match="no table of real eigenvalues"):
        read_f06(empty, 0.0, interface=100, ground=[101], damping=0.01)


@pytest.mark.parametrize(("printed", "value"), [("1.5-3", 1.5e-3), ("2.0E+01", 20.0), ("1.0D+2", 100.0), ("4.0", 4.0)])
def test_numbers_are_read_as_nastran_prints_them(printed: str, value: float, tmp_path: Path) -> None:
    path = tmp_path / "one.f06"
    path.write_text(F06.read_text().replace(" 6.134846E+00 ", f" {printed:>12} ", 1))
    found = read_f06(path, 0.0, interface=100, ground=[101], damping=0.01)
    assert found.frequency[0] == pytest.approx(value)
