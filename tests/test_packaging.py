"""What is installed holds everything that the package reads: templates, presets, assets."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[1]
BUILD = "import sys; from setuptools import build_meta as b; print(getattr(b, sys.argv[1])(sys.argv[2]))"


def build(tree: Path, kind: str, target: Path) -> Path:
    """Build a wheel or a source distribution as an installer does."""
    target.mkdir(exist_ok=True)
    done = subprocess.run(
        [sys.executable, "-c", BUILD, f"build_{kind}", str(target)],
        cwd=tree,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return target / done.stdout.splitlines()[-1]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A copy of the sources, and the wheel built from nothing but the source distribution of that."""
    place = tmp_path_factory.mktemp("packaging")
    tree = place / "tree"
    tree.mkdir()
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, tree)
    ignored = shutil.ignore_patterns("*.egg-info", "__pycache__")
    shutil.copytree(ROOT / "pipeline", tree / "pipeline", ignore=ignored)
    source = build(tree, "sdist", place / "sdist")
    with tarfile.open(source) as archive:
        archive.extraction_filter = getattr(tarfile, "data_filter", None)  # early releases of 3.11 have none
        archive.extractall(place / "unpacked")
    (unpacked,) = (place / "unpacked").iterdir()
    return tree, build(unpacked, "wheel", place / "wheel")


def test_the_wheel_holds_every_file_of_the_package(built: tuple[Path, Path]) -> None:
    with zipfile.ZipFile(built[1]) as wheel:
        packed = set(wheel.namelist())
    package = built[0] / "pipeline" / "kbs_process"
    files = {path.relative_to(package.parent).as_posix() for path in package.rglob("*") if path.is_file()}
    assert files <= packed


def test_the_installed_package_reads_campaigns_and_presets(built: tuple[Path, Path], tmp_path: Path) -> None:
    with zipfile.ZipFile(built[1]) as wheel:
        wheel.extractall(tmp_path)
    code = f"""
import sys; sys.path.insert(0, {str(tmp_path)!r})
from pathlib import Path
import kbs_process
from kbs_process.campaign.load import load_campaign
from kbs_process.studies.convert.mapping import find_mapping, load_mapping
load_mapping(find_mapping("emps"))
print(load_campaign(Path({str(ROOT / "campaigns" / "EL089")!r}), checksums=False).name, kbs_process.__file__)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout.split() == ["EL089", str(tmp_path / "kbs_process" / "__init__.py")], done.stderr


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--help"], "validate campaign/EL089"),
        (["schema", "campaign"], '"title": "campaign.toml: one test campaign"'),
        (["init", "made", "--from", "a.csv"], "wrench Fx in N"),
    ],
)
def test_the_wheel_works_without_a_checkout(
    built: tuple[Path, Path], tmp_path: Path, words: list[str], said: str
) -> None:
    with zipfile.ZipFile(built[1]) as wheel:
        wheel.extractall(tmp_path / "site")
    (tmp_path / "a.csv").write_text("t_s,Fx [N],az_deg\n" + "".join(f"{k},{k % 3},{k}\n" for k in range(40)))
    code = (
        f"import sys; sys.path.insert(0, {str(tmp_path / 'site')!r}); from kbs_process.cli import main; main({words})"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and said in done.stdout, done.stderr


def test_what_is_built_and_archived_says_of_which_commit(built: tuple[Path, Path], tmp_path: Path) -> None:
    tree = tmp_path / "tree"
    shutil.copytree(built[0], tree, ignore=shutil.ignore_patterns("*.egg-info", "build"))
    shutil.copy(ROOT / ".gitattributes", tree)

    def git(*words: str) -> str:
        who = ["-c", "user.name=test", "-c", "user.email=test@localhost"]
        return subprocess.run(
            ["git", *who, *words], cwd=tree, capture_output=True, text=True, check=True
        ).stdout.strip()

    git("init", "-q")
    git("add", "-A")
    git("commit", "-qm", "all")
    head = git("rev-parse", "HEAD")
    git("archive", "-o", str(tmp_path / "a.tar"), "HEAD")
    source = build(tree, "sdist", tmp_path / "sdist")
    wheel = build(tree, "wheel", tmp_path / "wheel")
    with tarfile.open(tmp_path / "a.tar") as archive, tarfile.open(source) as distribution:
        for packed in (archive, distribution):
            (member,) = (one for one in packed.getmembers() if one.name.endswith("kbs_process/commit.txt"))
            assert (file := packed.extractfile(member)) and file.read().decode().strip() == head
    with zipfile.ZipFile(wheel) as packed_wheel:
        assert packed_wheel.read("kbs_process/commit.txt").decode().strip() == head
    assert "$Format" in (tree / "pipeline" / "kbs_process" / "commit.txt").read_text()
