"""The archived campaigns, processed once for all tests that look at them, in processes of their own.

`python -m end_to_end.archive_run FOLDER NAME` processes one campaign without its page, which takes longest, and lists
in FOLDER.opened what it opened meanwhile.
"""

from __future__ import annotations

import fcntl
import json
import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
from numpy.typing import NDArray

import archived

Array = NDArray[np.float64]
TESTS = Path(__file__).resolve().parents[1]
WITH_PAGE = frozenset({"EL089"})  # processed as a user does, page and all


@dataclass(frozen=True)
class Processed:
    """One campaign's results folder."""

    name: str
    folder: Path

    @cached_property
    def results(self) -> dict[str, Any]:
        """Contents of results.json."""
        return json.loads((self.folder / "results.json").read_text())

    @property
    def opened(self) -> list[Path]:
        """Every file and folder that processing opened, where it was without its page."""
        return [Path(line) for line in _opened(self.folder).read_text().splitlines()]

    def table(self, name: str) -> dict[str, Array]:
        """Columns of a table: `gravity/EL089P00_1`."""
        table = pq.read_table(self.folder / "tables" / f"{name}.parquet")
        return {column: table[column].to_numpy() for column in table.column_names}


def _opened(target: Path) -> Path:
    return target.with_name(f"{target.name}.opened")


def processed(name: str, root: Path) -> Processed:
    """Process an archived campaign into `root`/NAME, unless that was done, or is being done, by another process."""
    target = root / name
    with (root / f"{name}.once").open("w") as once:
        fcntl.flock(once, fcntl.LOCK_EX)
        if not (target / "results.json").exists():
            process_apart(name, target)
    return Processed(name, target)


def process_apart(name: str, target: Path, environment: Mapping[str, str] | None = None, folder: Path = TESTS) -> None:
    """Process an archived campaign in another process, started in `folder`; warnings are errors."""
    arguments = (
        ["kbs_process", str(archived.CAMPAIGNS / name), "--output", str(target), "--no-pdf", "--no-diagnose", "--quiet"]
        if name in WITH_PAGE
        else ["end_to_end.archive_run", str(target), name]
    )
    subprocess.run(
        [sys.executable, "-W", "error", "-m", *arguments],
        cwd=folder,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1"} | dict(environment or {}),
        stdout=subprocess.DEVNULL,
        check=True,
    )


def main() -> None:
    """Process one campaign without its page, and list what is opened."""
    sys.path = [place for place in sys.path if place != str(TESTS)]  # no place to look for modules
    opened: set[object] = set()
    events = ("open", "os.listdir", "os.scandir")
    sys.addaudithook(lambda event, args: opened.add(args[0]) if event in events else None)
    from kbs_process.campaign.load import load_campaign
    from kbs_process.progress import SilentProgress
    from kbs_process.studies.correlate import run

    target, name = Path(sys.argv[1]), sys.argv[2]
    run.process(load_campaign(archived.CAMPAIGNS / name), target, progress=SilentProgress(), page=False)
    _opened(target).write_text("\n".join(sorted({str(one) for one in opened if isinstance(one, str | bytes | Path)})))


if __name__ == "__main__":
    main()
