"""What the search's slopes are taken over."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.floor import declared
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis
from kbs_process.diagnosis.experiments.metric import metrics
from kbs_process.diagnosis.experiments.thresholds import DETECTED, TOLERATED
from kbs_process.diagnosis.nominal.costs import GEARS, Found, Ground
from kbs_process.diagnosis.nominal.detection import Detection
from kbs_process.diagnosis.nominal.known import refit
from kbs_process.diagnosis.nominal.parameters import known_parameters, prior
from kbs_process.diagnosis.nominal.search import Search
from kbs_process.diagnosis.nominal.tangents import Step
from kbs_process.identification.output_error import rig_at
from kbs_process.rig.model import substitute

pytestmark = pytest.mark.validation


def searching(made: Experiment) -> Search:
    begin, simulate = Hypothesis(made.rig, made.effects), bench.serial(made)
    free = known_parameters(made.rig, made.effects)
    metric = metrics(made, declared(made), dict(enumerate(simulate([(0, begin)]))), begin)
    return Search(made, metric, simulate, begin, free, prior(made.rig, made.rig, made.effects, free))


def test_no_refit_leaves_what_bodies_and_joints_may_have() -> None:
    rig = bench.rig()
    free = known_parameters(rig, ())
    limits = prior(rig, rig, (), free)
    lower, body = dict(zip(limits.names, limits.lower, strict=True)), rig.bodies[0].name
    assert lower[f"body.{body}.mass"] == 0.0
    assert [lower[f"body.{body}.inertia[{k}]"] for k in range(6)] == [0.0] * 3 + [-np.inf] * 3
    assert 0.0 < lower["transducer.stiffness[0]"] < 1e-5 * rig.quantities()["transducer.stiffness"].value[0]
    wild = limits.clipped(limits.value - 1e3 * np.where(np.isfinite(limits.sigma), limits.sigma, 0.0))
    for xx, yy, zz, xy, xz, yz in rig_at(rig, free, wild).inertias.values():
        assert np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).min() >= -1e-9


def test_differences_span_what_a_step_has_moved_within_their_bounds() -> None:
    made = bench.experiment(bench.rig(), ("fit",), seed=3)
    search = searching(made)
    sharp = np.diag(1e12 / search.spread**2)  # which a difference of next to nothing would show
    search.settle(sharp, np.zeros(len(search.free)))
    still = search.differences.copy()
    search.settle(sharp, 0.1 * search.spread)
    assert np.allclose(search.differences, 0.1 * search.spread) and (still < search.differences).all()
    search.settle(sharp, 100.0 * search.spread)
    assert (search.differences < search.spread).all()


def test_steps_correct_slopes_until_those_of_the_drives_are_taken_anew() -> None:
    search = searching(bench.experiment(bench.rig(), ("fit",), seed=3))
    begun = search.begin(search.hypothesis.values(search.free))
    theta = begun.theta + 0.3 * np.where(np.isfinite(search.parameters.sigma), search.parameters.sigma, 0.1)
    stepped = Step(theta, search.predict([theta], [0])[0], promised=0.0, gained=0.0)
    corrected = search.updated(begun.gradients, begun.theta, stepped)
    (body,) = (i for i in search.slow if search.free[i].name == "body.antenna.mass")
    assert not np.array_equal(corrected[0].columns[body], begun.gradients[0].columns[body])
    change = np.tensordot(theta - begun.theta, corrected[0].columns, axes=1)
    assert np.allclose(change, stepped.predicted[0].values - begun.predicted[0].values, atol=1e-9)
    again = search.slopes(theta, corrected, GEARS)
    assert np.array_equal(again[0].columns[body], begun.gradients[0].columns[body])
    (drive,) = (i for i in search.geared if search.free[i].name == "joint.el.drive.Tmax")
    assert not np.array_equal(again[0].columns[drive], begun.gradients[0].columns[drive])


@pytest.mark.parametrize(("wave", "share", "rounds"), [(1.0, 0.05, 1), (1.0, 0.5, 10), (0.01, 0.05, 10)])
def test_a_descent_gives_up_where_much_is_left_and_a_step_does_little_of_it(
    monkeypatch: pytest.MonkeyPatch, wave: float, share: float, rounds: int
) -> None:
    """A wave (N) that no number makes, and steps that are said to gain a `share` of what is left."""
    made = bench.experiment(bench.rig(), ("fit",), seed=3)
    (trial,) = made.trials
    missing = np.zeros_like(trial.measured)
    missing[:, 2] = wave * np.sin(2.0 * np.pi * 3.0 * made.dt * np.arange(len(missing))) * trial.valid
    search = searching(replace(made, trials=(replace(trial, measured=trial.measured + missing),)))
    begun = search.begin(search.hypothesis.values(search.free))

    def step(found: Found, ground: Ground) -> Step:
        left = max(search.left(begun), 1e4)
        return Step(found.theta, found.predicted, promised=1.5 * share * left, gained=share * left)

    monkeypatch.setattr(search, "step", step)
    ended = search.descend(begun, giving_up=True)
    assert (search.gross(ended), ended.rounds, ended.converged) == (wave > 0.1, rounds, False)
    assert search.descend(begun).rounds == 10


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


def test_a_leap_that_ends_higher_is_taken_back(monkeypatch: pytest.MonkeyPatch) -> None:
    search = searching(bench.experiment(bench.rig(), ("fit",), seed=3))
    theta = search.hypothesis.values(search.free)
    here, there = search.begin(theta), search.begin(theta + 0.3 * np.minimum(search.spread, 1.0))
    low, high = sorted((here, there), key=search.height)
    assert search.height(high) > search.height(low) + 100.0
    monkeypatch.setattr(search, "descend", lambda found, *_, **__: found)
    for begun, leads_to in ((low, high), (high, low)):
        monkeypatch.setattr(search, "leapt", lambda _, *, smooth, to=leads_to: to)
        assert search.run(begun, leaps=1) is low
