"""A copy of the package to which a test adds what an engineer would add."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import kbs_process


def copy_package(folder: Path) -> Path:
    """Copy the package into `folder`; return the copy."""
    package = folder / "kbs_process"
    shutil.copytree(Path(kbs_process.__file__).parent, package)  # with what is compiled: it is found by its file's date
    return package


def run_copy(folder: Path, *words: str) -> str:
    """Run `kbs-process` of the copy in `folder` in that folder; return what it prints."""
    command = [sys.executable, "-m", "kbs_process", *words]
    environment = os.environ | {"PYTHONPATH": str(folder)}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout
