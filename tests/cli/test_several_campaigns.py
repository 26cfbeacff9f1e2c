"""Several campaigns at once: each is processed as it would be alone, and none stands in another's way."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner

from archived import CAMPAIGNS
from kbs_process.cli import cli


def run(*words: str) -> tuple[int, str, str]:
    done = CliRunner().invoke(cli, [*words])
    return done.exit_code, done.stdout, done.stderr


@pytest.mark.slow
def test_each_is_processed_whatever_becomes_of_the_others(tmp_path: Path) -> None:
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / "campaign.toml").write_text("name = ", encoding="utf-8")
    sound = str(CAMPAIGNS / "AZPS_ATA")
    status, said, complaint = run(sound, str(broken), "--no-diagnose", "--no-pdf", "-o", str(tmp_path / "out"))
    assert status == 2
    assert f"{sound}:\n" in said and f"{broken}:\n" in said
    assert str(tmp_path / "out" / "AZPS_ATA" / "index.html") in said
    assert "error: " in complaint and "campaign.toml" in complaint
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"AZPS_ATA"}
    status, _, _ = run(sound, "--no-diagnose", "--no-pdf", "-o", str(tmp_path / "alone"))
    assert status == 0
    names = {path.relative_to(tmp_path / "alone") for path in (tmp_path / "alone").rglob("*") if path.is_file()}
    for name in names:
        assert (tmp_path / "alone" / name).read_bytes() == (tmp_path / "out" / "AZPS_ATA" / name).read_bytes()


def test_two_of_one_name_are_refused(tmp_path: Path) -> None:
    for place in ("a", "b"):
        shutil.copytree(CAMPAIGNS / "AZPS_ATA", tmp_path / place / "AZPS_ATA", ignore=shutil.ignore_patterns("*.mcap"))
    status, _, complaint = run(str(tmp_path / "a" / "AZPS_ATA"), str(tmp_path / "b" / "AZPS_ATA"))
    assert status == 2 and "the same name" in complaint
