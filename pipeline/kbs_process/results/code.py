"""Which code made results: a commit where one is known, and the files themselves where none says it all."""

from __future__ import annotations

import hashlib
import json
import subprocess
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import kbs_process

CHANGED = "+"  # after a commit from which the files differ


@cache
def commit(package: Path = Path(kbs_process.__file__).parent) -> str:
    """Return the commit of the package's files, `CHANGED` where they differ from it; empty where none is known.

    It is that of the checkout that they are in, the one that an installer says it fetched them from, or the one that
    the archive or the wheel was made of.
    """
    return _of_checkout(package) or _of_installation(package) or _of_archive(package)


def source(package: Path = Path(kbs_process.__file__).parent) -> str:
    """Return the SHA-256 of the package's Python files, where no commit says what is in them; else nothing.

    Of names and contents in the order of the names: a checkout and what is installed from it give the same.
    """
    known = _of_checkout(package) or _of_installation(package)  # who unpacks an archive may change its files
    return "" if known and not known.endswith(CHANGED) else _digest(package)


@cache
def content(package: Path = Path(kbs_process.__file__).parent) -> str:
    """Return the SHA-256 of all files of the package: what computes the same has the same."""
    return _digest(package, "*")


@cache
def _digest(package: Path, which: str = "*.py") -> str:
    whole = hashlib.sha256()
    files = (path for path in package.rglob(which) if path.is_file() and "__pycache__" not in path.parts)
    names = sorted(path.relative_to(package).as_posix() for path in files)
    for name in names:
        content = (package / name).read_bytes()
        whole.update(f"{name}\n{len(content)}\n".encode() + content)
    return whole.hexdigest()


def _of_checkout(package: Path) -> str:
    inside = ["git", "-C", str(package)]
    try:
        head = subprocess.run([*inside, "rev-parse", "HEAD"], capture_output=True, text=True, timeout=10, check=True)
        # A package installed below someone else's repository is not part of it.
        subprocess.run(
            [*inside, "ls-files", "--error-unmatch", "__init__.py"], capture_output=True, timeout=10, check=True
        )
        changed = subprocess.run(
            [*inside, "status", "--porcelain", "--untracked-files=no", "--", "."],
            capture_output=True,
            text=True,
            timeout=10,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return head.stdout.strip() + (CHANGED if changed.stdout.strip() else "")


def _of_installation(package: Path) -> str:
    """The commit in direct_url.json (PEP 610), as after `pip install git+https://...`."""
    try:
        installed = distribution("kbs-process")
    except PackageNotFoundError:
        return ""
    if Path(str(installed.locate_file(package.name))).resolve() != package.resolve():
        return ""  # another copy than the one that runs
    url = json.loads(installed.read_text("direct_url.json") or "{}")
    return str(url.get("vcs_info", {}).get("commit_id", ""))


def _of_archive(package: Path) -> str:
    """The commit in the file that git fills in as it makes an archive, and setup.py as it builds."""
    try:
        text = (package / "commit.txt").read_text(encoding="ascii").strip()
    except OSError:
        return ""
    return "" if text.startswith("$") else text
