"""Results name the code that made them, however it came to where it runs."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest

import kbs_process
from kbs_process.results import code

PACKAGE = Path(kbs_process.__file__).parent
COMMIT = "0123456789abcdef0123456789abcdef01234567"


def copy_of(package: Path, target: Path) -> Path:
    shutil.copytree(package, target, ignore=shutil.ignore_patterns("__pycache__"))
    return target


def git(folder: Path, *words: str) -> str:
    who = ["-c", "user.name=a", "-c", "user.email=a@example.org"]
    done = subprocess.run(["git", "-C", str(folder), *who, *words], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_a_copy_without_git_is_named_by_its_files(tmp_path: Path) -> None:
    one, other = (copy_of(PACKAGE, tmp_path / name / "kbs_process") for name in ("one", "other"))
    assert code.commit(one) == ""
    digest = code.source(one)
    assert len(digest) == 64
    assert code.source(other) == digest
    third = copy_of(one, tmp_path / "third" / "kbs_process")
    with (third / "errors.py").open("a") as stream:
        stream.write("# another remark\n")
    assert code.source(third) != digest


def test_a_checkout_is_named_by_its_commit_and_by_its_files_only_if_they_differ(tmp_path: Path) -> None:
    package = tmp_path / "kbs_process"
    package.mkdir()
    (package / "__init__.py").write_text("")
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", "kbs_process")
    git(tmp_path, "commit", "-qm", "first")
    head = git(tmp_path, "rev-parse", "HEAD")
    assert (code.commit(package), code.source(package)) == (head, "")
    code.commit.cache_clear()
    (package / "__init__.py").write_text("changed = True\n")
    assert code.commit(package) == head + "+"
    assert len(code.source(package)) == 64


def test_an_installer_that_fetched_a_commit_says_which(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "site" / "kbs_process"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("")
    url = json.dumps({"url": "https://example.org/x.git", "vcs_info": {"vcs": "git", "commit_id": COMMIT}})
    record = tmp_path / "site" / "kbs_process-0.1.0.dist-info"
    record.mkdir()
    (record / "METADATA").write_text("Metadata-Version: 2.1\nName: kbs-process\nVersion: 0.1.0\n")
    (record / "direct_url.json").write_text(url)
    monkeypatch.syspath_prepend(tmp_path / "site")
    assert (code.commit(package), code.source(package)) == (COMMIT, "")
    elsewhere = copy_of(package, tmp_path / "elsewhere" / "kbs_process")
    assert code.commit(elsewhere) == ""


def test_an_archive_names_its_commit_and_its_files_as_they_may_be_changed(tmp_path: Path) -> None:
    package = copy_of(PACKAGE, tmp_path / "kbs_process")
    (package / "commit.txt").write_text(f"{COMMIT}\n")
    assert code.commit(package) == COMMIT
    assert len(code.source(package)) == 64
