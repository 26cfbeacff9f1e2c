"""Writes into what is built the commit that it is built from; all else is in pyproject.toml."""

from __future__ import annotations

import subprocess
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

FILE = "commit.txt"


def told() -> str:
    """The commit of the checkout, "+" where files differ; of anything else what its file says."""
    git = ["git", "-C", "pipeline/kbs_process"]
    try:
        subprocess.run([*git, "ls-files", "--error-unmatch", FILE], capture_output=True, check=True)
        head = subprocess.run([*git, "rev-parse", "HEAD"], capture_output=True, text=True, check=True).stdout.strip()
        changed = subprocess.run(
            [*git, "status", "--porcelain", "--untracked-files=no", "--", "."], capture_output=True, check=True
        ).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return Path("pipeline/kbs_process", FILE).read_text(encoding="ascii").strip()
    return head + ("+" if changed else "")


def write(target: Path) -> None:
    """Write it in place of the file there, which may be a link into the checkout."""
    text = told()
    target.unlink(missing_ok=True)
    target.write_text(f"{text}\n", encoding="ascii")


class Build(build_py):
    """A build of the package."""

    def run(self) -> None:
        super().run()
        if not self.editable_mode:
            write(Path(self.build_lib, "kbs_process", FILE))


class Source(sdist):
    """A source distribution."""

    def make_release_tree(self, base_dir: str, files: list[str]) -> None:
        super().make_release_tree(base_dir, files)
        write(Path(base_dir, "pipeline", "kbs_process", FILE))


setup(cmdclass={"build_py": Build, "sdist": Source})
