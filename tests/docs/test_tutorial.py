"""The tutorial works: its commands, typed in its order, print what it shows."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from docs.console import Command, agrees, steps
from kbs_process.report.build import available

ROOT = Path(__file__).parents[2]
REFUSED = 2


@pytest.fixture(scope="module")
def clone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the tutorial needs of a clone in which the README's command has been run."""
    folder = tmp_path_factory.mktemp("clone")
    shutil.copytree(ROOT / "campaigns" / "EL089", folder / "campaigns" / "EL089")
    activate = folder / ".venv" / "bin" / "activate"
    activate.parent.mkdir(parents=True)
    activate.write_text(f'PATH="{Path(sys.executable).parent}:$PATH"\n')
    return folder


@pytest.mark.slow
def test_every_command_prints_what_is_shown(clone: Path) -> None:
    activated = "true"
    for step in steps(ROOT / "docs" / "tutorial.md"):
        if not isinstance(step, Command):
            (clone / step.path).write_text(step.text, encoding="utf-8")
            continue
        if step.line.startswith(". "):
            activated = step.line
        done = subprocess.run(
            ["bash", "-c", f"{activated} && {step.line}"],
            cwd=clone,
            env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
            capture_output=True,
            text=True,
            check=False,
        )
        refused = step.shown.startswith("error:")
        printed = done.stderr if refused else done.stdout
        told = f"$ {step.line}\n{done.stdout}{done.stderr}"
        assert done.returncode == (REFUSED if refused else 0), told
        assert agrees(step.shown, printed), f"{told}\nshown:\n{step.shown}"
    if available():
        assert (clone / "results" / "arm" / "report.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(
    ("shown", "printed", "same"),
    [
        ("Peak 0.0212 N m", "Peak 0.0214 N m", True),
        ("Peak 0.0212 N m", "Peak 0.0312 N m", False),
        ("Peak 0.0212 N m", "Peak -0.0212 N m", False),
        ("EL089P00_1: clean", "EL089P00_2: clean", False),
        ("met. Peak 1", "not met. Peak 1", False),
        ("a\n...\nb 7", "a\nx 1\ny\nb 7", True),
        ("  1 deg", "   1.01 deg\n", True),
        ("1 warning", "1 warning: two", False),
    ],
)
def test_what_counts_as_the_same_output(shown: str, printed: str, same: bool) -> None:
    assert agrees(shown, printed) == same
