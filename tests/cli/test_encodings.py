"""A terminal that lacks a letter gets an escape in its place, and no command fails on that."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.slow
@pytest.mark.parametrize(
    "environment",
    [{"PYTHONIOENCODING": "latin-1"}, {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}],
    ids=["latin-1", "C"],
)
def test_any_name_can_be_printed(tmp_path: Path, environment: dict[str, str]) -> None:
    path = os.fsencode(tmp_path) + "/d\u00e9 \u2192 t.csv".encode()
    Path(os.fsdecode(path)).write_text("t,Kraft \u2192\n0,1\n", encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "kbs_process", "import", "--describe", path],
        env={**os.environ, **environment},
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert b"Kraft " in done.stdout
