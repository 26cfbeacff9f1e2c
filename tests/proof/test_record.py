"""The benchmark of record: which trials it has, and how two columns of it are compared."""

from __future__ import annotations

from collections import Counter

import pytest

from proof import coverage
from proof.answer import Answer, Claim, Moved
from proof.concealed.effects import BY_NAME
from proof.paired import paired
from proof.record import COUNT, NULLS, draw, name_of, nulls
from proof.score import Bench
from proof.truth import Concealed, Truth


def test_the_trials_are_of_all_kinds_from_the_first_on() -> None:
    specs = draw()
    assert len(specs) == COUNT and specs[:10] == draw(10)
    for block in range(0, COUNT, 5):
        shown = [[BY_NAME[name] for name in spec.physics[: spec.count]] for spec in specs[block : block + 5]]
        assert [len(one) for one in shown] == [1, 1, 1, 1, 2]
        assert [one[0].catalogued for one in shown] == [True, True, True, False, True]
        assert shown[4][0].port != shown[4][1].port
    singles = Counter(BY_NAME[spec.physics[0]].family for k, spec in enumerate(specs) if k % 5 < 3)
    assert len(singles) >= 22 and max(singles.values()) <= 2
    assert {level for spec in specs for level in spec.levels} == {100.0, 300.0, 1000.0}


def test_nulls_are_of_all_kinds_and_no_trial_of_the_others() -> None:
    specs = nulls()
    assert len(specs) == NULLS and specs[:10] == nulls(10)
    kinds = Counter(spec.kind for spec in specs)
    assert kinds == {"within": 40, "nothing": 40, "beyond": 20}
    names = [name_of(spec) for spec in (*draw(), *specs)]
    assert len(set(names)) == COUNT + NULLS and names[0] == "R000" and names[COUNT] == "N000"
    assert not {spec.index for spec in specs} & {spec.index for spec in draw()}


def test_numbers_of_an_answer_are_held_against_the_hardware_of_its_trial() -> None:
    (spec,) = nulls(1)
    nominal, true = coverage.hardware(spec)
    name, key = "joint.el.drive.parameters.Ka", "joint.el.drive.Ka"
    spread, value = float(nominal.sigmas[key]), float(true[key])
    said = [Moved(name=name, value=value + k * spread, sigma=0.1 * spread, sigmas=0.0) for k in (0.0, 0.15, 0.25)]
    found = list(coverage.answered(said, nominal, true))
    assert [one.error for one in found] == pytest.approx([0.0, 0.15, 0.25], abs=1e-9)
    assert [one.covered for one in found] == [True, True, False] and all(one.told for one in found)


def truth(trial: str) -> Truth:
    effect = Concealed(
        port="joint torque", axis="el", family="harness", name="exponential harness", rho=310, rho_eff=300
    )
    return Truth(trial=trial, kind="concealed", split="development", level=300.0, effects=(effect,), rho_eff=300.0)


def answer(trial: str, axis: str, seconds: float) -> Answer:
    claim = Claim(port="joint torque", axis=axis, family="harness")
    return Answer(method="kbs-process", trial=trial, detected=True, verdict="physics", finds=(claim,), seconds=seconds)


def bench(axes: dict[str, str], seconds: float) -> Bench:
    return Bench(
        split="development",
        seed="1996",
        command="",
        isolation="",
        rows=(),
        truths=tuple(truth(name) for name in axes),
        answers=tuple(answer(name, axis, seconds) for name, axis in axes.items()),
    )


def test_what_is_won_and_lost_is_counted_on_the_trials_that_both_answered() -> None:
    before = bench({"R000": "el", "R001": "az", "R002": "az", "R003": "el"}, 100.0)
    after = bench({"R000": "az", "R001": "el", "R002": "el", "R004": "el"}, 50.0)
    lines = paired(before, after)
    assert lines[0] == "3 trials"
    (place,) = [line.split() for line in lines if line.startswith("place ") and "three" not in line]
    assert place[1:6] == ["1", "2", "3", "2", "1"]
    assert float(place[6]) == pytest.approx(1.0)
    assert lines[-1].startswith("time: 0.50 ")
