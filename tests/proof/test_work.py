"""A bench goes on where it stopped, and nothing may change once seals are broken."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest

from proof import seal, trials
from proof.answer import Answer, encode
from proof.truth import Truth
from proof.work import BenchError, Work

METHODS = ("kbs-process", "sparse")


def draw(split: str, count: int, seed: int) -> list[int]:
    return [1000 * seed + index for index in range(count)]


def make(specification: int, folder: Path) -> dict[str, Any]:
    (folder / "campaign.toml").write_text(f"seed = {specification}\n")
    return {"trial": folder.name, "kind": "nothing", "split": "development"}


def answered(trial: str, method: str, seconds: float = 1.0) -> bytes:
    return encode(Answer(method=method, trial=trial, detected=False, verdict="none", seconds=seconds))


def work(folder: Path, count: int = 3, seed: int | None = 5) -> Work:
    return Work(folder, "development", count, seed, "kbs-process prove", SimpleNamespace(draw=draw, make=make))


def finished(folder: Path) -> Work:
    bench = work(folder)
    for order in bench.orders():
        bench.keep_trial(order.name, trials.make_sealed(order, make))
    for name, methods in bench.unanswered(METHODS):
        for method in methods:
            bench.keep_answer(name, method, answered(name, method))
    return bench


def test_what_is_answered_before_the_first_gap_can_be_judged_and_the_rest_stays_sealed(tmp_path: Path) -> None:
    bench = work(tmp_path)
    for order in bench.orders():
        bench.keep_trial(order.name, trials.make_sealed(order, make))
    names = sorted(bench.plan.names)
    with pytest.raises(BenchError, match="first trial has no answer"):
        bench.close(METHODS)
    for name in (names[0], names[2]):
        for method in METHODS:
            bench.keep_answer(name, method, answered(name, method))
    truths, answers = bench.open(bench.close(METHODS))
    assert [truth.trial for truth in truths] == names[:1]
    assert {one.trial for one in answers} == {names[0]}
    # Once seals are broken there is no going on.
    for method in METHODS:
        bench.keep_answer(names[1], method, answered(names[1], method))
    with pytest.raises(BenchError, match="changed after seals were broken"):
        bench.close(METHODS)
    with pytest.raises(BenchError, match="its other trials are lost"):
        bench.begin("alone")


def test_only_what_is_missing_is_done_again(tmp_path: Path) -> None:
    bench = work(tmp_path)
    first, *others = bench.orders()
    bench.keep_trial(first.name, trials.make_sealed(first, make))
    bench.keep_answer(first.name, "sparse", answered(first.name, "sparse"))
    again = work(tmp_path)
    assert [order.name for order in again.orders()] == [order.name for order in others]
    assert dict(again.unanswered(METHODS))[first.name] == ("kbs-process",)
    assert again.key == bench.key and again.plan == bench.plan


def test_names_say_nothing_and_secrets_are_the_owners(tmp_path: Path) -> None:
    names = {work(tmp_path / str(k)).plan.names for k in range(3)}
    assert len(names) == 3  # of the same seed
    plan = work(tmp_path / "secret", seed=None).plan
    assert plan.seed != work(tmp_path / "other", seed=None).plan.seed
    for file in ("key", "plan.json"):
        assert (tmp_path / "secret" / file).stat().st_mode & 0o077 == 0


def test_seals_open_only_with_the_ledger_closed(tmp_path: Path) -> None:
    bench = finished(tmp_path)
    truths, answers = bench.open(bench.close(METHODS))
    assert sorted(truth.trial for truth in truths) == sorted(bench.plan.names)
    assert all(isinstance(truth, Truth) for truth in truths) and len(answers) == 6
    bench.close(METHODS)  # nothing has changed: the score can be taken again


def test_an_answer_that_changes_after_the_seals_were_broken_is_refused(tmp_path: Path) -> None:
    bench = finished(tmp_path)
    bench.close(METHODS)
    name = bench.plan.names[0]
    bench.keep_answer(name, "sparse", answered(name, "sparse", seconds=2.0))
    with pytest.raises(BenchError, match=r"sparse.*changed after seals were broken"):
        bench.close(METHODS)


def test_a_trial_that_is_exchanged_is_refused(tmp_path: Path) -> None:
    bench = finished(tmp_path)
    bench.close(METHODS)
    order = trials.Order(bench.plan.names[1], 99, seal.public(bench.key))
    bench.keep_trial(order.name, trials.make_sealed(order, make))
    with pytest.raises(BenchError, match="seals, changed"):
        bench.close(METHODS)


def test_another_bench_in_the_same_folder_is_refused(tmp_path: Path) -> None:
    work(tmp_path)
    with pytest.raises(BenchError, match="another bench"):
        work(tmp_path, count=4)


def test_what_is_made_is_what_the_contract_asks() -> None:
    def wrong(specification: int, folder: Path) -> dict[str, Any]:
        return make(specification, folder) | {"hint": 1}

    with pytest.raises(msgspec.ValidationError, match="hint"):
        trials.make_sealed(trials.Order("T1", 1, seal.public(seal.new_key())), wrong)
