"""Sets are pooled trial by trial: the same table as if all had been one set, on trials that all methods answered."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import msgspec
import pytest

from proof import pooled
from proof.answer import Answer
from proof.score import Bench, score
from proof.truth import Truth
from proof.words import OURS


@dataclass
class Sets:
    """Three trials in two sets that share one; the rival answered the first set alone."""

    truths: tuple[Truth, ...]
    ours: tuple[Answer, ...]
    rival: tuple[Answer, ...]

    def all(self) -> list[Bench]:
        """Both sets."""
        return [bench(self.truths[:2], (*self.ours[:2], *self.rival), "1"), bench(self.truths[1:], self.ours[1:], "2")]


def bench(truths: tuple[Truth, ...], answers: tuple[Answer, ...], seed: str) -> Bench:
    return Bench(
        split="validation", seed=seed, command="", isolation="namespaces", rows=(), truths=truths, answers=answers
    )


@pytest.fixture
def sets() -> Sets:
    truths = tuple(Truth(trial=f"T{k}", kind="nothing", split="validation") for k in range(3))

    def said(method: str, trial: str, detected: bool) -> Answer:
        return Answer(method=method, trial=trial, detected=detected, verdict="none", seconds=1.0)

    ours = tuple(said(OURS, truth.trial, truth.trial == "T2") for truth in truths)
    return Sets(truths, ours, tuple(said("sparse", truth.trial, True) for truth in truths[:2]))


def test_a_trial_of_two_sets_counts_once(sets: Sets) -> None:
    found = pooled.pooled(sets.all(), (OURS,), "")
    assert found.rows == score(sets.truths, sets.ours)
    assert [row.of for row in found.rows if row.metric == "false alarm" and row.group == "all"] == [3]
    assert found.seed == "1, 2"


def test_methods_are_compared_on_the_same_trials(sets: Sets) -> None:
    found = pooled.pooled(sets.all(), (OURS, "sparse"), "")
    assert {truth.trial for truth in found.truths} == {"T0", "T1"}
    shares = {row.method: row.value for row in found.rows if (row.metric, row.group) == ("false alarm", "all")}
    assert shares == {OURS: 0.0, "sparse": 1.0}


def test_sets_that_disagree_are_refused(sets: Sets) -> None:
    changed = msgspec.structs.replace(sets.ours[1], verdict="undecided")
    with pytest.raises(ValueError, match=r"different things of .*T1"):
        pooled.pooled([*sets.all(), bench(sets.truths[1:2], (changed,), "3")], (OURS,), "")
    other = bench(sets.truths, sets.ours, "4")
    with pytest.raises(ValueError, match="not pooled"):
        pooled.pooled([*sets.all(), msgspec.structs.replace(other, split="development")], (OURS,), "")
    with pytest.raises(ValueError, match="no trial was answered by boosting"):
        pooled.pooled(sets.all(), ("boosting",), "")


def test_command_writes_table_and_page(sets: Sets, tmp_path: Path) -> None:
    files = []
    for number, one in enumerate(sets.all()):
        files.append(tmp_path / f"{number}.json")
        files[-1].write_bytes(msgspec.json.encode(one))
    pooled.main([*map(str, files), "--output", str(tmp_path / "out")])
    rows = msgspec.json.decode((tmp_path / "out" / "rows.json").read_bytes())
    assert {row["method"] for row in rows} == {OURS}
    assert "<table" in (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
