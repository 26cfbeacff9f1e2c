"""Numbers that are far off: where they go in a metric that takes what is left for noise, before they are set free."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from kbs_process.diagnosis.experiments.floor import declared
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis
from kbs_process.diagnosis.nominal.known import as_it_is, refit
from kbs_process.diagnosis.selection import explain
from kbs_process.diagnosis.selection.explain import NEAR, eased
from kbs_process.rig.model import substitute

pytestmark = pytest.mark.validation

OFF = {"body.antenna.cog": 2}  # elements; a short swing shows little of the others
SIGMAS = 8.0


def test_numbers_that_are_far_off_go_to_where_they_are() -> None:
    nominal = bench.rig()
    quantities = nominal.quantities()
    right = {}
    for name, element in OFF.items():
        value = np.array(quantities[name].value, dtype=float)
        value[element] += SIGMAS * quantities[name].sigma[element]
        right[name] = value
    made = bench.experiment(substitute(nominal, right), ("fit", "fit"), 5)
    simulate, floor = bench.serial(made), declared(made)
    near = refit(made, Hypothesis(made.rig, made.effects), floor, simulate, reach=NEAR, leaps=0)
    assert near.gross
    gone = eased(near, simulate)
    found = gone.rig.quantities()
    for name, element in OFF.items():
        apart = (found[name].value[element] - quantities[name].value[element]) / quantities[name].sigma[element]
        assert apart == pytest.approx(SIGMAS, abs=2.0), name
    # Bounds are none of those that kept them near.
    freed = refit(made, gone, floor, simulate, leaps=0)
    assert not freed.gross and freed.level < 0.2 * near.level


def test_nothing_moves_where_nothing_is_wrong() -> None:
    made = bench.experiment(bench.rig(), ("fit", "fit"), 5)
    simulate, floor = bench.serial(made), declared(made)
    near = refit(made, Hypothesis(made.rig, made.effects), floor, simulate, reach=NEAR, leaps=0)
    gone = eased(near, simulate)
    assert as_it_is(near, simulate).cost == pytest.approx(near.cost, rel=1e-9)
    moved = np.abs(gone.values(near.free) - near.value)[near.stated] / near.parameters.sigma[near.stated]
    assert moved.max() < 0.5


def test_phases_are_looked_for_again_beside_numbers_that_were_refitted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the numbers that they were looked for beside first leave much, and only if that halves it."""
    made = bench.experiment(bench.rig(), ("fit", "fit"), 5)
    simulate, floor = bench.serial(made), declared(made)
    right = refit(made, Hypothesis(made.rig, made.effects), floor, simulate, reach=NEAR, leaps=0)
    worse, little = (
        replace(right, residual=tuple(z * np.sqrt(share * len(z) / (z @ z)) for z in right.residual))
        for share in (3.0, 2.2)
    )
    assert worse.gross
    begun = []

    def begin(experiment: object, hypothesis: Hypothesis, *_: object) -> Hypothesis:
        begun.append(hypothesis)
        return hypothesis

    monkeypatch.setattr(explain.phasing, "begin", begin)
    for found, kept in ((right, right), (little, worse)):
        monkeypatch.setattr(explain, "refit", lambda *_, found=found, **__: found)
        again = explain._rephased(explain._stood(worse, floor), floor, simulate)
        assert again.known is kept
    assert all(one is worse.hypothesis for one in begun) and len(begun) == 2
