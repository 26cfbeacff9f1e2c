"""The pages in reports/: few, made by one script, and still read and rendered by the present code."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import msgspec
import pytest

from kbs_process.results.records import FILE, Record, kind_of, load
from kbs_process.studies.documents import DOCUMENTS, render
from proof.pooled import pooled
from proof.score import Row
from proof.validations import load_bench
from proof.words import METHODS, OURS

ROOT = Path(__file__).parents[2]
REPORTS = ROOT / "reports"
PAGES = sorted(path.parent for path in REPORTS.glob(f"*/{FILE}"))
MEGABYTE = 1e6


def tracked(below: str) -> list[Path]:
    """Files that git tracks."""
    told = subprocess.run(["git", "ls-files", "-z", below], cwd=ROOT, capture_output=True, text=True, check=True)
    return [ROOT / name for name in told.stdout.split("\0") if name and (ROOT / name).exists()]


def provenance(results: Record) -> tuple[str, str]:
    """Version and commit of results of any kind."""
    made = results.provenance  # type: ignore[attr-defined]  # every kind of results has it
    return made.version, made.commit


def test_the_script_makes_every_page() -> None:
    script = (REPORTS / "remake").read_text(encoding="utf-8")
    made = set(re.findall(r"--output (?:\.\./)?reports/(\S+)", script))
    shown = {str(page.parent.relative_to(REPORTS)) for page in REPORTS.glob("**/index.html")}
    assert made == shown


@pytest.mark.parametrize("folder", PAGES, ids=lambda folder: folder.name)
def test_a_page_is_rendered_again_and_says_of_which_version_it_is(folder: Path, tmp_path: Path) -> None:
    shutil.copyfile(folder / FILE, tmp_path / FILE)  # without its tables: figures that need them are left out
    again = render(tmp_path, pdf=False).read_text(encoding="utf-8")
    results = load(folder, DOCUMENTS[kind_of(folder)].record)
    archived = (folder / "index.html").read_text(encoding="utf-8")
    for text in provenance(results):
        assert text and f">{text}<" in again and f">{text}<" in archived


@pytest.mark.parametrize(("folder", "methods"), [("pooled", (OURS,)), ("pooled-rivals", METHODS)])
def test_the_pooled_pages_are_those_of_the_stored_sets(folder: str, methods: tuple[str, ...]) -> None:
    stored = msgspec.json.decode((REPORTS / "proof" / folder / "rows.json").read_bytes(), type=tuple[Row, ...])
    sets = [load_bench(path.parent.name) for path in REPORTS.glob("proof/*/score.json")]
    assert set(stored) == set(pooled(sets, methods, "").rows)


def test_a_clone_is_small() -> None:
    assert sum(path.stat().st_size for path in tracked("reports")) < 10 * MEGABYTE
    assert sum(path.stat().st_size for path in tracked(".")) < 40 * MEGABYTE
