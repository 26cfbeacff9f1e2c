"""Numbers that are far off: where they go in a metric that takes what is left for noise, before they are set free."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis import bench
from kbs_process.diagnosis.explain import NEAR, eased
from kbs_process.diagnosis.floor import declared
from kbs_process.diagnosis.hypothesis import Hypothesis
from kbs_process.diagnosis.known import as_it_is, refit
from kbs_process.rig.model import substitute

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
        apart = (found[name].value[element] - quantities[name].value[element]) / quantities[name].sigma[
            element
        ]
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
