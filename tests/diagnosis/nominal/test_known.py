"""The known parameters, refitted to what the plant itself made."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from kbs_process.diagnosis.experiments import floor
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, predict
from kbs_process.diagnosis.nominal.known import LEARNT, Known, confined, refit
from kbs_process.diagnosis.nominal.parameters import COUPLING, known_parameters, prior, slopes
from kbs_process.rig.model import substitute
from kbs_process.signals.records import Array

pytestmark = pytest.mark.slow

MOVED: dict[str, Array | float] = {
    "body.antenna.mass": 14.06,
    "joint.el.drive.Ka": 1.08e4,
    "body.antenna.cog": np.array([0.073, 0.06, -0.018]),
}


@pytest.fixture(scope="module")
def found() -> Known:
    truth = substitute(bench.unrounded(bench.rig()), MOVED)
    experiment = bench.experiment(truth, ("fit", "fit", "held-out"), seed=2, bare_encoders=True)
    left = {k: trial.measured for k, trial in enumerate(experiment.trials)}
    noise = floor.estimate(experiment, left)
    start = Hypothesis(experiment.rig, experiment.effects)
    return refit(experiment, start, noise, bench.serial(experiment), leaps=0)


def test_refit_finds_what_was_moved_and_leaves_noise(found: Known) -> None:
    assert found.chi2_before[0] > 3.0 * found.rows[0]
    for name, true in MOVED.items():
        for place, scalar in enumerate(found.free):
            if scalar.quantity == name:
                value = float(np.asarray(true)[scalar.element])
                assert abs(found.value[place] - value) < 4.0 * found.sigma[place], scalar.name
    # a hundred numbers fitted to some thousands
    assert found.level == pytest.approx(0.95, abs=0.12)


def test_held_out_residual_is_noise_as_well(found: Known) -> None:
    held = found.experiment.held_out[0]
    # it has its share in a floor of few degrees of freedom
    assert found.chi2[held] / found.rows[held] == pytest.approx(0.92, abs=0.15)


def test_parameters_within_their_uncertainties_are_not_called_off(found: Known) -> None:
    check = next(check for check in found.checks if check.name == "within uncertainties")
    assert check.passed, check.detail


def test_numbers_are_strained_where_recordings_have_them_farther_than_chance(found: Known) -> None:
    """Refits of hardware that is drawn from the prior, seen with the noise: N(0, S - C)."""
    chosen, rng = found.stated, np.random.default_rng(5)
    sigma = found.parameters.sigma[chosen]
    C = found.covariance[np.ix_(chosen, chosen)] / np.outer(sigma, sigma)
    variance, directions = np.linalg.eigh(np.eye(len(sigma)) - C)
    spread = directions * np.sqrt(np.maximum(variance, 0.0))

    def moved(by: Array) -> Known:
        value = found.parameters.value.copy()
        value[chosen] += sigma * by
        return replace(found, value=value)

    drawn = [moved(spread @ rng.standard_normal(len(sigma))) for _ in range(200)]
    assert 0 < drawn[0].strain.count < len(sigma)
    assert np.mean([one.strain.squares / one.strain.count for one in drawn]) == pytest.approx(1.0, abs=0.05)
    assert not any(one.strained for one in drawn[:50])
    untold = directions[:, variance < LEARNT] @ np.full(int(np.sum(variance < LEARNT)), 3.0)
    assert moved(untold).strain.squares < 1e-9
    # The same length where recordings tell.
    assert moved(directions[:, -1] * np.linalg.norm(untold)).strained


def test_coupling_needs_no_simulation_and_slopes_are_those_of_the_prediction() -> None:
    experiment = bench.experiment(bench.rig(), ("fit",), seed=1, seconds=12.0)
    here = Hypothesis(experiment.rig, experiment.effects)
    free = [s for s in known_parameters(experiment.rig, experiment.effects) if s.quantity == COUPLING][:7]
    calls: list[int] = []

    def counted(tasks):  # type: ignore[no-untyped-def]
        calls.append(len(tasks))
        return bench.serial(experiment)(tasks)

    by = slopes(experiment, here, free, np.full(len(free), 1e-3), [0], counted)[0]
    assert calls == [1]
    moved = here.at(free, here.values(free) + 1e-3)
    change = predict(moved, experiment, 0).values - by.base.values
    assert change == pytest.approx(1e-3 * by.columns.sum(axis=0), abs=1e-9)


def test_priors_are_those_of_the_files_wherever_a_search_begins(found: Known) -> None:
    elsewhere = substitute(found.hypothesis.rig, {"body.antenna.mass": 14.5})
    free = [scalar for scalar in found.free if scalar.quantity == "body.antenna.mass"]
    assert prior(elsewhere, found.experiment.rig, found.hypothesis.effects, free).value == [14.0]


def test_numbers_confined_stay_nearer_to_what_is_known_and_leave_more(found: Known) -> None:
    reach = 0.5
    assert np.nanmax(np.abs(found.moved)) > 1.2 * reach
    held = confined(found, bench.serial(found.experiment), reach)
    assert np.nanmax(np.abs(held.moved)) <= reach * (1.0 + 1e-9)
    assert held.cost > found.cost + 25.0
    # what it hands on may go where it could before
    assert held.parameters.upper == pytest.approx(found.parameters.upper)
