"""The archived campaigns, processed once for all tests that look at them, in processes of their own.

`python -m end_to_end.archive_run FOLDER NAME...` processes campaigns without their pages, which take longest.
"""

from __future__ import annotations

import fcntl
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pyarrow.parquet as pq
from numpy.typing import NDArray

from engine.campaigns import CAMPAIGNS_FOLDER
from kbs_process.ingest import Stream, open_recording

Array = NDArray[np.float64]
WRENCH = tuple(f"wrench.{part}.{axis}" for part in ("force", "torque") for axis in "xyz")
TESTS = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Processed:
    """One campaign's results folder."""

    name: str
    folder: Path

    @cached_property
    def results(self) -> dict[str, Any]:
        """Contents of results.json."""
        return json.loads((self.folder / "results.json").read_text())

    def table(self, name: str) -> dict[str, Array]:
        """Columns of a table: `gravity/EL089P00_1`."""
        table = pq.read_table(self.folder / "tables" / f"{name}.parquet")
        return {column: table[column].to_numpy() for column in table.column_names}

    def wrench(self, recording: str, topic: str) -> tuple[NDArray[np.int64], Array]:
        """Stamps (n,) in ns and wrench (n, 6) of a topic of the processed recording."""
        source = open_recording(self.folder / "processed" / f"{recording}.mcap")
        blocks = [block for _, block in source.read([Stream("wrench", topic, WRENCH)])]
        return (
            np.concatenate([block.stamp for block in blocks]),
            np.concatenate([block.values for block in blocks]),
        )


def processed(name: str, root: Path, *, page: bool = False) -> Processed:
    """Process an archived campaign into `root`/NAME, unless that was done before, here or by another worker."""
    target = root / name
    with (root / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (target / "results.json").exists():
            run_alone(target, name, page=page)
    return Processed(name, target)


def run_alone(target: Path, name: str, *, page: bool, **environment: str) -> None:
    """Process a campaign in another process, as the command line does, warnings being errors."""
    words = (
        ["kbs_process.cli", f"{CAMPAIGNS_FOLDER / name}", "--output", f"{target}", "--no-pdf", "--quiet"]
        if page
        else ["end_to_end.archive_run", f"{target}", name]
    )
    subprocess.run(
        [sys.executable, "-W", "error", "-m", *words],
        cwd=TESTS,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1"} | environment,
        check=True,
    )


def main() -> None:
    """Process one campaign without its page."""
    from kbs_process.campaign import run
    from kbs_process.campaign.load import load_campaign
    from kbs_process.campaign.progress import SilentProgress

    target, name = Path(sys.argv[1]), sys.argv[2]
    with patch.object(run.build, "build", lambda folder, _: folder / "index.html"):
        run.process(load_campaign(CAMPAIGNS_FOLDER / name), target, progress=SilentProgress(), pdf=False)


if __name__ == "__main__":
    main()
