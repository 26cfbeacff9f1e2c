"""A measured law in the plant: the curve that was found, at its port, and in the corrected model's files."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from diagnosis import bench
from diagnosis.selection.test_rounds import standing
from kbs_process.campaign.load import load_campaign
from kbs_process.campaign.writing.corrected_model import write_model
from kbs_process.diagnosis.acceptance import verdict
from kbs_process.diagnosis.acceptance.plausible import pushes
from kbs_process.diagnosis.acceptance.verdict import gated
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, predict
from kbs_process.diagnosis.nominal.joint import Own, with_extra
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.diagnosis.proposing.curves import CurveSuspect, along, basis, curves
from kbs_process.diagnosis.proposing.measured import extra, inserted
from kbs_process.diagnosis.screening.gls import Score, Sums, score
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.diagnosis.screening.screen import Bench, Found
from kbs_process.plant.effect import Port
from kbs_process.plant.laws.position.measured_law import COEFFICIENTS, MEASURED, Measured, torque, torque_over_rate

pytestmark = pytest.mark.slow

# Of a bump in the middle of the range, N m.
BUMP = np.array([0.0, 0.0, 0.02, 0.1, 0.3, 0.3, 0.1, 0.02, 0.0, 0.0])
SLOPE = np.linspace(-1.0, 1.0, COEFFICIENTS)


OVER_ANGLE, OVER_RATE = MEASURED[:2]


def test_friction_near_rest_is_such_a_curve() -> None:
    """Of two thousandths of the range, to a few percent, and Stribeck's fall."""
    x = np.linspace(-0.05, 0.05, 4001)
    stribeck = np.tanh(x / 5e-4) * (1.0 + 0.5 * np.exp(-np.abs(x) / 4e-3))
    B = basis(OVER_RATE, x, -0.05, 0.05)
    left = stribeck - B @ np.linalg.lstsq(B, stribeck, rcond=None)[0]
    assert np.std(left) < 0.05 * np.std(stribeck)


def test_the_plants_spline_is_the_curves_and_holds_beyond_its_ends() -> None:
    rng = np.random.default_rng(3)
    coefficients = rng.standard_normal(COEFFICIENTS)
    x = rng.uniform(-1.0, 2.0, 200)
    for law, equation in ((OVER_ANGLE, torque), (OVER_RATE, torque_over_rate)):
        one_by_one = [equation(float(at), -0.4, 1.1, *map(float, coefficients)) for at in x]
        columns = basis(law, x, -0.4, 1.1)
        np.testing.assert_allclose(columns @ coefficients, one_by_one, rtol=0.0, atol=1e-13)
        np.testing.assert_allclose(columns.sum(axis=1), 1.0, rtol=1e-13)
        np.testing.assert_allclose(along(law, -0.4, 1.1)[[0, -1]], [-0.4, 1.1], rtol=0.0)
        assert (np.diff(along(law, -0.4, 1.1)) > 0.0).all()
    ends = basis(OVER_ANGLE, np.array([-0.4, -9.0, 1.1, 9.0]), -0.4, 1.1) @ coefficients
    assert ends[0] == ends[1] != ends[2] == ends[3]


def test_cubic_polynomials_are_such_curves() -> None:
    x = np.linspace(0.2, 0.9, 300)
    cubic = 1.0 - 3.0 * x + 2.0 * x**2 - 0.7 * x**3
    B = basis(OVER_ANGLE, x, 0.2, 0.9)
    np.testing.assert_allclose(B @ np.linalg.lstsq(B, cubic, rcond=None)[0], cubic, atol=1e-12)


@pytest.fixture(scope="module")
def scene() -> Scene:
    made = bench.experiment(bench.rig(), ("fit", "held-out"), 1)
    hypothesis = Hypothesis(made.rig, made.effects)
    return Scene.of(made, hypothesis, {0: predict(hypothesis, made, 0)})


def named(name: str) -> Measured:
    return next(law for law in MEASURED if law.effect.name == name)


def suspect(scene: Scene, law: Measured) -> CurveSuspect:
    return next(c for c in curves(scene) if (c.law, c.joint) == (law, "el"))


@pytest.mark.parametrize("law", MEASURED, ids=lambda law: law.effect.name)
def test_the_plant_with_it_shows_what_the_screen_expected(scene: Scene, law: Measured) -> None:
    """At the encoder, and where the laboratory reacts it, about the axis at the transducer."""
    made, curve = scene.experiment, suspect(scene, law)
    coefficients = BUMP if not law.of_rate else 0.02 + 0.01 * SLOPE if law.opposed else -0.02 * SLOPE
    if law.effect.port is Port.MOTOR_TORQUE:
        coefficients = coefficients / float(made.rig.joint("el").drive.ratio)  # type: ignore[union-attr]
    hypothesis, scalars = inserted(scene.hypothesis, law, "el", curve.ends, coefficients, 0.1 * coefficients)
    np.testing.assert_array_equal(hypothesis.values(scalars), coefficients)
    change = predict(hypothesis, made, 0).values - scene.predicted[0].values
    expected = bench_of(scene).signatures([curve], 0) @ coefficients
    for channel in ("el", "Ty") if law.effect.port is Port.GROUND_TORQUE else ("el",):
        c = made.channels.index(channel)
        seen, meant = (values[:, c] - values[:, c].mean() for values in (change, expected))
        # A friction damps what it starts, and a rotor's rate has more than its mean between the screen's samples.
        near = 0.1 if law.opposed or law.effect.port is Port.MOTOR_TORQUE else 0.05
        assert np.linalg.norm(seen - meant) < near * np.linalg.norm(meant), channel


def bench_of(scene: Scene) -> Bench:
    """A bench of which nothing but experiment and scene is asked."""
    known = object.__new__(Known)
    object.__setattr__(known, "experiment", scene.experiment)
    return Bench(known, scene, None, ())  # type: ignore[arg-type]


def test_a_friction_that_pushes_is_none(scene: Scene) -> None:
    curve = suspect(scene, named("joint_friction_angle_law"))
    C = 1e-4 * np.eye(COEFFICIENTS)
    assert pushes(curve, BUMP, C) == ()
    (reason,) = pushes(curve, -BUMP, C)
    assert "friction brakes" in reason
    assert pushes(curve, -BUMP, 1e4 * C) == ()  # it may be anything
    assert pushes(suspect(scene, OVER_ANGLE), -BUMP, C) == ()


def test_a_second_one_at_the_same_joint_has_names_of_its_own(scene: Scene) -> None:
    law = named("joint_angle_law")
    first, _ = inserted(scene.hypothesis, law, "el", (0.0, 1.0), BUMP, 0.1 * BUMP)
    other, at_az = inserted(first, law, "az", (0.0, 1.0), BUMP, 0.1 * BUMP)
    assert other.effects == first.effects
    assert at_az[0].name == "joint.az.drive.angle_law_0"
    _, again = inserted(other, law, "el", (0.0, 1.0), BUMP, 0.1 * BUMP)
    assert again[0].name == "joint.el.drive.angle_law_0_2"


def test_written_it_loads_and_acts_where_it_was_found(scene: Scene, tmp_path: Path) -> None:
    campaign = load_campaign(bench.CAMPAIGN, checksums=False)
    given = Hypothesis(campaign.rig, campaign.effects)
    hypothesis = given
    for law in MEASURED:
        hypothesis, _ = inserted(hypothesis, law, "el", (0.1, 0.9), BUMP, 0.1 * BUMP)
    known = campaign.rig.quantities()
    changed = {
        name: entry for name, entry in hypothesis.rig.quantities().items() if name not in known or entry.value.ndim > 1
    }
    write_model(campaign, hypothesis.rig, hypothesis.effects, changed, tmp_path, "by a test")
    loaded = load_campaign(tmp_path, checksums=False)
    assert set(loaded.effects) == set(hypothesis.effects)
    found = loaded.rig.quantities()
    assert float(found["joint.el.drive.ground_rate_law_4"]) == BUMP[4]
    assert float(found["joint.el.drive.ground_rate_law_4"].sigma) == pytest.approx(0.1 * BUMP[4])
    assert float(found["joint.az.drive.ground_rate_law_4"]) == 0.0
    assert float(found["joint.az.drive.ground_rate_law_4"].sigma) == 0.0
    assert float(found["joint.az.drive.ground_rate_law_low"].sigma) == 0.0
    flown = load_campaign(tmp_path, checksums=False, flight=True)
    assert {"joint_angle_law", "joint_rate_law"} <= set(flown.effects)
    assert not {"ground_angle_law", "ground_rate_law"} & set(flown.effects)


def test_a_curve_is_refitted_inside_the_plant() -> None:
    """Recordings of a rig with a bump; the screen's coefficients, then those of the non-linear plant."""
    made = bench.experiment(bench.rig(), ("fit", "held-out"), 2)
    law, ends = named("ground_angle_law"), (1.25, 1.30)
    nominal = Hypothesis(made.rig, made.effects)
    truth, _ = inserted(nominal, law, "el", ends, BUMP, 0.0 * BUMP)
    added = predict(truth, made, 0).values - predict(nominal, made, 0).values
    made = replace(
        made,
        trials=tuple(replace(trial, measured=trial.measured + added * trial.valid[:, None]) for trial in made.trials),
    )
    before = standing(made)
    along = Bench.of(before.known, Scene.of(made, before.hypothesis, before.predicted))
    curve = suspect(along.scene, law)
    found = score(along.background, Sums.over(along.background, along.columns([curve])))
    after = with_extra(before, extra(curve, found, before), bench.serial(made))
    begin = len(before.known.value)
    assert [scalar.name for scalar in after.known.free[begin:]] == [
        f"joint.el.drive.ground_angle_law_{k}" for k in range(COEFFICIENTS)
    ]
    level = [float(one.chi2[1] / one.rows[1]) for one in (before.known, after.known)]
    assert level[0] > 10.0  # of the recording that was held out
    assert level[1] < 1.2
    x = np.linspace(1.26, 1.29, 20)
    # Any constant is a bias of the transducer.
    meant, shown = basis(law, x, *ends) @ BUMP, curve.basis(x) @ after.known.value[begin:]
    np.testing.assert_allclose(shown - shown.mean(), meant - meant.mean(), atol=0.02)


@pytest.mark.parametrize("excess", [False, True])
def test_a_curve_is_none_that_recordings_held_out_have_nothing_to_show_of(
    monkeypatch: pytest.MonkeyPatch, excess: bool
) -> None:
    made = bench.experiment(bench.rig(), ("fit", "held-out"), 1)
    if excess:
        louder = made.trials[1].measured + 3.0 * bench.noise(np.random.default_rng(2), *made.trials[1].measured.shape)
        made = replace(made, trials=(made.trials[0], replace(made.trials[1], measured=louder)))
    there = standing(made)
    of = Scene.of(made, there.hypothesis, there.predicted, linear=False)
    nothing = Score(0.0, 1, np.zeros(1), np.eye(1), 0.0, 0.0, np.zeros(1), 0.0, 1)
    found = Found(suspect(of, OVER_ANGLE), nothing, 0.0, 0.0, 1, ())
    names = there.known.names[-1:]
    judge = partial(gated, found, there, there, Own(names, names), bench.serial(there.known.experiment))
    reasons = judge().reasons
    assert ("recordings that were held out leave nothing that would show a curve" in reasons) != excess
    assert any("of the held-out excess is no law" in reason for reason in reasons) == excess
    # All that it changes may be right.
    monkeypatch.setattr(verdict, "foretold", lambda *_: True)
    assert not any("nothing that would show a curve" in reason for reason in judge().reasons)
