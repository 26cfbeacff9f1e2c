"""The same input gives the same output to the last bit, wherever and by whomever it is processed."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

import pytest

from end_to_end.archive_run import Processed, process_apart

pytestmark = pytest.mark.slow

# What differs between two users of one machine, and must not matter.
ELSEWHERE = {
    "PYTHONHASHSEED": "4242",
    "NUMBA_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "2",
    "OMP_NUM_THREADS": "2",
    "TZ": "Pacific/Auckland",
    "LANG": "de_DE.UTF-8",
    "LC_ALL": "de_DE.UTF-8",
    "COLUMNS": "40",
}


def digests(folder: Path) -> dict[str, str]:
    """SHA-256 of every file."""
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def test_every_file_comes_out_the_same(archived: Callable[[str], Processed], tmp_path: Path) -> None:
    """Other hash seed, threads, time zone, language, working directory and target: page, tables and signals alike."""
    first = archived("EL089")
    again = Processed("EL089", tmp_path / "elsewhere" / "results")
    process_apart("EL089", again.folder, ELSEWHERE, folder=tmp_path)
    commits = [one.results["provenance"]["commit"] for one in (first, again)]
    if commits[0] != commits[1]:
        pytest.skip(f"the checkout was changed in between: {' and '.join(commits)}")
    expected = digests(first.folder)
    assert {"index.html", "results.json", "processed/EL089P00_1.mcap"} <= expected.keys()
    assert len(expected) > 40
    assert digests(again.folder) == expected
