"""A run that is killed, meets another, or finds no room: old results stay whole, and the campaign is never touched."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from campaign.campaign_folder import CampaignFolder
from end_to_end.command import kbs_process
from kbs_process.results.store import LIST, writing

pytestmark = pytest.mark.slow

OLD = {"results.json": "old", "index.html": "old page"}
ROOM = "40"  # blocks of 512 bytes, less than a table needs
PATIENCE = 120.0  # s


@pytest.fixture
def target(tmp_path: Path) -> Path:
    """A folder with results of before."""
    folder = tmp_path / "results"
    with writing(folder) as new:
        for name, text in OLD.items():
            (new / name).write_text(text)
    return folder


@pytest.fixture
def read_only(folder: CampaignFolder) -> Iterator[Path]:
    """The campaign, without permission to write into it; root has it all the same."""
    paths = [folder.path, *folder.path.rglob("*")]
    for path in paths:
        path.chmod(0o555 if path.is_dir() else 0o444)
    yield folder.path
    for path in paths:
        path.chmod(0o755)


def start(campaign: Path, target: Path, *, blocks: str = "unlimited") -> subprocess.Popen[str]:
    """Begin to process a campaign in another process, whose files are no larger than some blocks of 512 bytes."""
    command = [
        sys.executable,
        "-m",
        "kbs_process",
        str(campaign),
        "-o",
        str(target),
        "--no-pdf",
        "--no-diagnose",
        "--quiet",
    ]
    return subprocess.Popen(
        ["sh", "-c", 'ulimit -f "$0" && exec "$@"', blocks, *command],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def wait_for(found: Callable[[], object], process: subprocess.Popen[str]) -> None:
    """Wait until something is found that the process makes."""
    end = time.monotonic() + PATIENCE
    while not found():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end
        time.sleep(0.02)


def content(folder: Path) -> dict[str, str]:
    return {path.name: path.read_text() for path in folder.iterdir() if path.name != LIST}


def state(folder: Path) -> dict[Path, tuple[int, int]]:
    """Size and time of change of every file and folder: a file that came and went changes its folder's."""
    return {
        path: (path.stat().st_size, path.stat().st_mtime_ns) for path in (folder, folder.parent, *folder.rglob("*"))
    }


def test_two_at_once_and_a_kill_amid_the_tables(
    read_only: Path, target: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The second run is refused and says who writes; the first is killed with half its tables on the disk."""
    before = state(read_only)
    first = start(read_only, target)
    try:
        wait_for(lambda: list(target.parent.glob(".results.new-*")), first)
        second = kbs_process(capsys, read_only, "-o", target, "-q")
        assert second.status == 2
        assert f"process {first.pid} on " in second.err
        assert "is writing results there" in second.err
        assert "--output" in second.err
        wait_for(lambda: list(target.parent.glob(".results.new-*/tables/*/*.parquet")), first)
    finally:
        first.kill()
        first.communicate()
    assert first.returncode == -signal.SIGKILL
    assert content(target) == OLD
    assert state(read_only) == before


def test_a_full_disk(folder: CampaignFolder, target: Path) -> None:
    """Files may not grow beyond some size, which the system tells as it tells of a full disk."""
    process = start(folder.path, target, blocks=ROOM)
    _, message = process.communicate(timeout=PATIENCE)
    assert process.returncode == 2, message
    assert f"error: {target}: the disk is full" in message
    assert "the results of before are whole" in message
    assert "--output" in message
    assert content(target) == OLD
    assert not list(target.parent.glob(".results.new-*"))


def test_results_do_not_go_into_the_campaign(read_only: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = state(read_only)
    ended = kbs_process(capsys, read_only, "-o", read_only / "results", "-q")
    assert ended.status == 2
    assert "campaign's folder" in ended.err
    assert "\n  -> " in ended.err
    assert state(read_only) == before
