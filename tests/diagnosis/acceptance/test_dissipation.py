"""A friction that would push is none, however well it fits; one that brakes more than it pushes may be."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis import bench
from kbs_process.diagnosis.acceptance.plausible import drives
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, predict
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.diagnosis.screening.screen import Catalogued
from kbs_process.diagnosis.screening.suspects import Candidate
from kbs_process.plant.laws import CATALOGUE
from kbs_process.signals.records import Array


@pytest.fixture(scope="module")
def scene() -> Scene:
    made = bench.experiment(bench.rig(), ("fit",), 1)
    hypothesis = Hypothesis(made.rig, made.effects)
    return Scene.of(made, hypothesis, {0: predict(hypothesis, made, 0)})


def suspect(scene: Scene, name: str) -> Catalogued:
    effect = next(one for one in CATALOGUE if one.name == name)
    shape = tuple((p.name, p.prior.middle) for p in effect.parameters if p.role == "shape")
    return Catalogued(Candidate(effect, "el", shape), scene)


def said(scene: Scene, name: str, *amplitudes: float, sigma: float = 1e-3) -> tuple[str, ...]:
    covariance: Array = np.eye(len(amplitudes)) * sigma**2
    return drives(suspect(scene, name), np.array(amplitudes), covariance)


@pytest.mark.parametrize("name", ["joint_viscous", "coulomb", "dahl", "motor_drag", "motor_dahl"])
def test_a_friction_takes_work(scene: Scene, name: str) -> None:
    assert said(scene, name, 0.5) == ()
    (reason,) = said(scene, name, -0.5)
    assert "does work" in reason
    assert said(scene, name, -0.5, sigma=1.0) == ()  # nobody knows its sign


def test_two_actions_of_one_law_are_judged_together(scene: Scene) -> None:
    assert said(scene, "coulomb", 0.5, -0.2) == ()
    assert said(scene, "coulomb", -0.5, 0.2) != ()


def test_a_friction_that_differs_with_the_sense_may_have_either_sign(scene: Scene) -> None:
    assert said(scene, "motor_asymmetry", 0.3, 0.3) == said(scene, "motor_asymmetry", -0.3, -0.3) == ()


def test_viscous_friction_does_the_work_of_its_rate(scene: Scene) -> None:
    tapped = scene.signals[0]
    rate = tapped.values[:, tapped.columns.index("joint_rate.el")]
    (reason,) = said(scene, "joint_viscous", -2.0)
    told = float(reason.split()[3])
    assert told == pytest.approx(2.0 * np.sum(rate**2) / tapped.rate, rel=0.02)


def test_what_brakes_one_way_more_than_it_pushes_the_other_and_what_is_no_friction_may_stay(scene: Scene) -> None:
    for amplitudes in ((0.6, -0.1), (-0.1, 0.6)):
        assert said(scene, "asymmetric_coulomb", *amplitudes) == ()
        assert said(scene, "asymmetric_coulomb", *(-a for a in amplitudes)) != ()
    assert said(scene, "harness", *(-0.5,) * 6) == ()
    assert said(scene, "motor_order", -0.5, -0.5) == ()
