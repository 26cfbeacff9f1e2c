"""What the search's slopes are taken over."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from kbs_process.diagnosis.detection import Detection
from kbs_process.diagnosis.floor import declared
from kbs_process.diagnosis.hypothesis import Hypothesis
from kbs_process.diagnosis.known import refit
from kbs_process.diagnosis.metric import metrics
from kbs_process.diagnosis.parameters import known_parameters, prior
from kbs_process.diagnosis.search import Search
from kbs_process.diagnosis.thresholds import DETECTED, TOLERATED
from kbs_process.rig.model import substitute


def test_differences_span_what_a_step_has_moved_within_their_bounds() -> None:
    made = bench.experiment(bench.rig(), ("fit",), seed=3)
    begin, simulate = Hypothesis(made.rig, made.effects), bench.serial(made)
    free = known_parameters(made.rig, made.effects)
    metric = metrics(made, declared(made), dict(enumerate(simulate([(0, begin)]))), begin)
    search = Search(made, metric, simulate, begin, free, prior(made.rig, made.rig, made.effects, free))
    sharp = np.diag(1e12 / search.spread**2)  # which a difference of next to nothing would show
    search.settle(sharp, np.zeros(len(free)))
    still = search.differences.copy()
    search.settle(sharp, 0.1 * search.spread)
    assert np.allclose(search.differences, 0.1 * search.spread) and (still < search.differences).all()
    search.settle(sharp, 100.0 * search.spread)
    assert (search.differences < search.spread).all()


def test_numbers_without_any_uncertainty_stay_and_their_phases_are_looked_for() -> None:
    truth = bench.rig()
    made = bench.experiment(truth, ("fit",), seed=4)
    quantities = made.rig.quantities().items()
    rig = substitute(
        made.rig,
        {name: quantity.value for name, quantity in quantities},
        {name: 0.0 * quantity.sigma for name, quantity in quantities if "transducer.bias" not in name},
    )
    made = replace(made, rig=rig)
    found = refit(made, Hypothesis(rig, made.effects), declared(made), bench.serial(made), leaps=0)
    assert found.free and all(".phi_" in name for name in found.names)
    assert np.isfinite(found.value).all() and np.isfinite(found.sigma).all()


@pytest.mark.parametrize(
    ("log_p", "ratio", "left"),
    [
        (np.log(DETECTED) - 1.0, 1.0 + 2.0 * TOLERATED, True),
        (np.log(DETECTED) - 1.0, 1.0 + 0.5 * TOLERATED, False),
        (np.log(DETECTED) + 1.0, 1.0 + 2.0 * TOLERATED, False),
    ],
)
def test_what_is_left_is_more_than_chance_and_more_than_the_search_is_good_for(
    log_p: float, ratio: float, left: bool
) -> None:
    assert Detection((), log_p, ratio).left is left
