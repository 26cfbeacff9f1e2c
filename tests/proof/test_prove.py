"""The bench from trials to its page, with a maker and methods made up; on threads, and on a Dask cluster."""

from __future__ import annotations

import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from kbs_process.errors import ConfigError
from kbs_process.studies import prove as verb
from proof import answer, prove
from proof.answer import Answer, Claim
from proof.methods import Job, failed
from proof.words import OURS
from proof.work import Work

pytestmark = pytest.mark.slow

COGGING = {"port": "motor torque", "axis": "el", "family": "cogging"}


def draw(split: str, count: int, seed: int) -> list[int]:
    return list(range(count))


def make(specification: int, folder: Path) -> dict[str, Any]:
    (folder / "campaign.toml").write_text("schema = 1\n")
    told = {"trial": folder.name, "kind": "nothing", "split": "development"}
    if specification % 3:
        effect = COGGING | {"name": "law", "rho": 300.0, "rho_eff": 300.0}
        told |= {"kind": "concealed", "level": 300.0, "rho_eff": 300.0, "effects": [effect]}
    return told


def guess(job: Job) -> dict[str, bytes]:
    """A method that always claims cogging, and one that never answers."""
    claimed = Answer(
        method=OURS,
        trial=job.trial,
        detected=True,
        verdict="physics",
        finds=(Claim(**COGGING),),  # type: ignore[arg-type]
        seconds=1.0,
    )
    given = {OURS: claimed, "sparse": failed("sparse", job.trial, 2.0, "gave up")}
    return {method: answer.encode(given[method]) for method in job.methods}


def test_a_bench_ends_with_a_score_a_ledger_and_a_page(tmp_path: Path) -> None:
    said: list[str] = []

    def run(methods: tuple[str, ...]) -> dict[tuple[str, str], float | None]:
        maker = SimpleNamespace(draw=draw, make=make)
        bench = Work(tmp_path / "work", "development", 4, 1, "kbs-process prove", maker)
        with ThreadPoolExecutor(2) as pool:
            prove.finish(bench, methods, pool, isolated="threads", tell=said.append, answered=guess)
        rows = prove.judge(bench, methods, tmp_path / "out", command="python -m proof", tell=said.append)
        return {(row.method, row.metric): row.value for row in rows if row.group == "all"}

    values = run((OURS,))
    assert values[OURS, "false find"] == 1.0 and values[OURS, "physics"] == 1.0
    assert sum(line.startswith("made") for line in said) == 4
    score, ledger = (json.loads((tmp_path / "out" / name).read_text()) for name in ("score.json", "ledger.json"))
    assert {truth["trial"] for truth in score["truths"]} == set(ledger["seals"]) == set(ledger["answers"][OURS])
    assert (tmp_path / "out" / "index.html").stat().st_size > 50_000
    said.clear()
    values = run((OURS, "sparse"))  # a rival that comes later finds trials and answers as they are
    assert values["sparse", "physics"] == 0.0 and values["sparse", "answered"] == 0.0
    assert not any(line.startswith("made") for line in said)
    assert sum("sparse" in line for line in said) == 4 and not any(OURS in line for line in said)


def test_the_verb_needs_a_checkout(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    installed = tmp_path / "site-packages" / "kbs_process" / "__init__.py"
    monkeypatch.setattr(verb.kbs_process, "__file__", str(installed))
    with pytest.raises(ConfigError, match="clone the repository") as caught:
        verb.run_bench([])
    readme = (Path(__file__).parents[2] / "README.md").read_text()
    install = caught.value.remedy.partition("with: pip install ")[2]
    assert install and f"pip install -q {install}" in readme, "as the tests are installed"


def test_the_verb_runs_the_bench_of_its_checkout() -> None:
    command = [sys.executable, "-c", "from kbs_process.cli import main; main()", "prove", "--trials", "none"]
    refused = subprocess.run(command, capture_output=True, text=True, check=False)
    assert refused.returncode == 2 and "--trials" in refused.stderr
    assert verb.run_bench(["--help"]) == 0
