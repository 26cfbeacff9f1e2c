"""What a notebook calls: loaded when used, silent, and the same numbers as the commands' files."""

from __future__ import annotations

import copy
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

import kbs_process
from end_to_end.archive_run import Processed


def test_names_are_few_and_loaded_when_used() -> None:
    assert len(kbs_process.__all__) <= 12
    for name in kbs_process.__all__:
        assert getattr(kbs_process, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'proces'"):
        getattr(kbs_process, "proces")  # noqa: B009
    code = "import sys, kbs_process; print([name for name in ('numpy', 'kbs_process.api') if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_the_stub_names_what_the_package_gives() -> None:
    stub = Path(kbs_process.__file__).with_suffix(".pyi").read_text()
    stated: dict[str, list[str]] = {}
    exec(stub[stub.index("__all__") :], stated)
    assert stated["__all__"] == kbs_process.__all__


@pytest.mark.slow
def test_results_are_records_and_tables(archived: Callable[[str], Processed]) -> None:
    folder = archived("EL089").folder
    results = kbs_process.Results(folder)
    stored = json.loads((folder / "results.json").read_text())
    assert results.kind == "correlation"
    assert results.verdict.sentence == stored["verdict"]["sentence"]
    assert [one.margin for one in results.requirements] == [one["margin"] for one in stored["requirements"]]
    assert results.report.is_file()
    assert stored["verdict"]["sentence"] in repr(results)
    assert "requirements" in dir(results)
    assert copy.copy(results).verdict == results.verdict
    with pytest.raises(AttributeError):
        _ = results.requirement

    table = pq.read_table(folder / "tables" / "spacecraft" / "EL089P00_2.lt1Hz.parquet")
    frame = results.table("spacecraft", "EL089P00_2", "lt1Hz")
    assert frame.equals(results.table("spacecraft/EL089P00_2.lt1Hz"))
    assert (frame.index.name, frame.attrs["frame"]) == ("t", "S")
    assert frame.attrs["units"]["Tx.measured"] == "N m"
    for name in table.column_names[1:]:
        np.testing.assert_array_equal(frame[name], table[name])
    with pytest.raises(kbs_process.KbsError, match=r"did you mean 'spacecraft/EL089P00_2\.lt1Hz'"):
        results.table("spacecraft", "EL089P00_2", "lt1")


def test_no_results_and_unknown_ones(tmp_path: Path) -> None:
    with pytest.raises(kbs_process.KbsError, match="no results here"):
        kbs_process.Results(tmp_path)
    (tmp_path / "results.json").write_text('{"kind": "correlatoin"}')
    with pytest.raises(kbs_process.KbsError, match="did you mean 'correlation'"):
        kbs_process.Results(tmp_path)


@pytest.mark.slow
def test_commands_of_a_table_are_simulated(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    t = np.arange(0.0, 1.0, 0.1)
    commands = pd.DataFrame({"t": t, "az": 0.0 * t, "el": 1.2 + 0.005 * t})
    streams = kbs_process.simulate("campaign/EL089", commands=commands, rate_Hz=50.0)
    kept = kbs_process.simulate(
        "campaign/EL089", None, tmp_path / "kept", commands=commands.set_index("t"), rate_Hz=50.0
    )
    assert sorted(streams) == ["angle", "field", "wrench"]
    for key, frame in streams.items():
        assert frame.equals(kept[key])
        assert frame.equals(kbs_process.read_table(tmp_path / "kept" / f"{key}.parquet"))
    assert len(streams["wrench"]) == 45
    assert streams["wrench"].attrs["units"]["Tx"] == "N m"
    assert capfd.readouterr() == ("", "")
    with pytest.raises(kbs_process.KbsError, match="give one of them"):
        kbs_process.simulate("campaign/EL089", "EL089P00", commands=commands)
