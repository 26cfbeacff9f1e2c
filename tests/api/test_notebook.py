"""The notebook in docs/ runs from its first cell to its last, and shows what it says."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import matplotlib
import matplotlib.pyplot as plt
import pytest

NOTEBOOK = Path(__file__).resolve().parents[2] / "docs" / "notebook.ipynb"


@pytest.mark.slow
def test_the_notebook_runs(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    assert NOTEBOOK.stat().st_size < 200_000
    matplotlib.use("Agg")
    monkeypatch.chdir(NOTEBOOK.parent)
    known: dict[str, Any] = {}
    for cell in json.loads(NOTEBOOK.read_text())["cells"]:
        if cell["cell_type"] == "code":
            exec("".join(cell["source"]), known)

    printed, complained = capfd.readouterr()
    assert printed == f"{known['campaign'].title}\n{known['results'].verdict.sentence}\n"
    assert complained == ""
    assert len(plt.get_fignums()) == 2
    plt.close("all")
    assert not Path(known["scratch"].name).exists()
    assert known["results"].verdict.status == "pass"
    assert list(known["labelled"].columns[:1]) == ["Fx.measured, (N)^2/Hz"]
    measured, predicted = known["frame"]["Ty.measured"], known["frame"]["Ty.predicted"]
    assert measured.std() == pytest.approx(predicted.std(), rel=0.1)
    assert abs(measured.abs().idxmax() - predicted.abs().idxmax()) < 10.0  # s: in the same burst
    assert known["predicted"]["wrench"]["Ty"].abs().max() > 0.0
