"""The metric that takes what is left for noise: where nothing is missing it is the floor's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from kbs_process.diagnosis.experiments.floor import declared
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, predict
from kbs_process.diagnosis.experiments.metric import excess_density, metrics, softened
from kbs_process.diagnosis.nominal.joint import Standing, standing_of
from kbs_process.diagnosis.nominal.known import Known, as_it_is, refit
from kbs_process.diagnosis.nominal.settling import bent, detected, drawn_back
from kbs_process.diagnosis.selection.explain import NEAR
from kbs_process.signals.records import Array

pytestmark = pytest.mark.slow

CHANNEL, HZ = 4, 3.0


@pytest.fixture(scope="module")
def pulled() -> Known:
    """Numbers that are what the files say, and were pulled far away beside what is missing: a tone of the floor's."""
    made = bench.experiment(bench.rig(), ("fit", "fit"), 8)
    t = bench.DT * np.arange(made.drives[0].n)
    tone = 0.1 * np.sin(2.0 * np.pi * HZ * t)[:, None] * (np.arange(len(made.channels)) == CHANNEL)
    trials = tuple(replace(one, measured=one.measured + tone * one.valid[:, None]) for one in made.trials)
    made = replace(made, trials=trials)
    start = Hypothesis(made.rig, made.effects)
    found = refit(made, start, declared(made), bench.serial(made), reach=NEAR, leaps=0)
    away = np.array([name.startswith("body.") for name in found.names]) & found.stated
    value = np.where(away, found.parameters.value + 3.0 * found.parameters.sigma, found.value)
    return as_it_is(replace(found, value=value, shown={}), bench.serial(made))


def test_the_residual_of_a_line_is_noise_there_and_nothing_else_changes() -> None:
    made = bench.experiment(bench.rig(), ("fit", "fit"), 3, seconds=40.0)
    here = Hypothesis(made.rig, made.effects)
    shown = {0: predict(here, made, 0)}
    metric = metrics(made, declared(made), shown)
    t = bench.DT * np.arange(made.drives[0].n)
    tone = np.zeros((len(t), len(made.channels)))
    tone[:, CHANNEL] = 0.02 * np.sin(2.0 * np.pi * HZ * t)

    def left(one: int, extra: float) -> Array:
        trial = made.trials[one]
        return trial.measured + extra * tone * trial.valid[:, None] - shown[0].values

    residual = {k: metric[k](left(k, 1.0)) for k in made.fit}
    f, v = excess_density(metric, residual)
    near = np.abs(f - HZ) < 0.05
    assert v[near, CHANNEL].min() > 50.0
    away = (np.abs(f - HZ) > 0.5) & (f > 1.0)
    assert np.median(v[away]) < 1.3  # of noise, never below 1
    blind = metric[0], replace(metric[1], share=np.zeros(len(made.channels)))
    seen = excess_density(blind, {0: residual[0], 1: 0.0 * residual[1]})[1]
    assert seen == pytest.approx(excess_density(metric, {0: residual[0]})[1])
    soft = softened(made, metric, residual, shown, here)
    z = soft[0].layout(soft[0](left(0, 1.0)))
    assert np.mean(z[:, near, CHANNEL] ** 2) < 2.0
    bare = metric[0].layout(metric[0](left(0, 0.0)))[:, away][..., [0, 1, 2, 3, 5]]
    assert np.mean((z[:, away][..., [0, 1, 2, 3, 5]] / bare) ** 2 > 0.5) > 0.95


def test_laws_are_looked_for_from_numbers_that_were_drawn_back(pulled: Known) -> None:
    assert pulled.gross and pulled.strained
    simulate = bench.serial(pulled.experiment)
    floor = declared(pulled.experiment)
    standing = standing_of(pulled, {})
    back = drawn_back(standing, floor, simulate).known
    assert back.strain.squares < 0.3 * pulled.strain.squares
    assert back.gross and back.excess < pulled.excess  # the tone is no number's
    assert back.metric is pulled.metric
    calm = Standing(replace(pulled, residual=tuple(0.01 * z for z in pulled.residual)), standing.predicted, {})
    assert drawn_back(calm, floor, simulate) is calm


def test_numbers_that_leave_nothing_are_drawn_back_if_chance_has_them_elsewhere() -> None:
    made = bench.experiment(bench.rig(), ("fit", "fit"), 8)
    floor, simulate = declared(made), bench.serial(made)
    found = refit(made, Hypothesis(made.rig, made.effects), floor, simulate, reach=NEAR, leaps=0)
    assert not bent(standing_of(found, {}), floor)
    assert drawn_back(standing_of(found, {}), floor, simulate).known is found
    # Had the files said other numbers, the recordings would have pulled them to these.
    prior = found.parameters
    apart = np.where(found.stated, 3.0 * np.where(found.stated, prior.sigma, 0.0), 0.0)
    pulled = standing_of(replace(found, parameters=replace(prior, value=found.value - apart)), {})
    assert bent(pulled, floor)
    back = drawn_back(pulled, floor, simulate).known
    assert back.strain.squares < 0.5 * pulled.known.strain.squares
    assert detected(standing_of(back, {}), floor, made.fit).left  # what they had taken up
    # Nor is it looked past that single ones are off, until a law is found to be likelier.
    off = replace(prior, value=found.value - 2.0 * apart)
    assert bent(standing_of(replace(found, parameters=off), {}), floor)
