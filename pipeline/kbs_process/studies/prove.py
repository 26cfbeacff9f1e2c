"""The proof bench, which comes with the source and not with the package: what judges is no part of what is judged."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import kbs_process
from kbs_process.errors import ConfigError


def run_bench(arguments: Sequence[str]) -> int:
    """Run the bench of this checkout with `arguments`, in a process of its own; return its exit status.

    Raises ConfigError where the package is not run from a checkout.
    """
    tests = Path(kbs_process.__file__).resolve().parents[2] / "tests"
    if not (tests / "proof" / "__main__.py").is_file():
        raise ConfigError(
            "the proof bench is part of the source, and this installation holds the package alone",
            where=str(Path(kbs_process.__file__).parent),
            remedy="clone the repository, and install it with: pip install -c .ci/constraints.txt -e '.[test]'",
        )
    command = [sys.executable, "-m", "proof", *arguments]
    return subprocess.run(command, env={**os.environ, "PYTHONPATH": str(tests)}, check=False).returncode
