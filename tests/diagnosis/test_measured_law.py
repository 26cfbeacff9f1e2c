"""A measured law in the plant: the curve that was found, at its port, and in the corrected model's files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import bench
import numpy as np
import pytest
from test_rounds import standing

from kbs_process.campaign.corrected_model import write_model
from kbs_process.campaign.load import load_campaign
from kbs_process.diagnosis.curves import CurveSuspect, basis, curves
from kbs_process.diagnosis.gls import Sums, score
from kbs_process.diagnosis.hypothesis import Hypothesis, predict
from kbs_process.diagnosis.joint import with_extra
from kbs_process.diagnosis.known import Known
from kbs_process.diagnosis.measured import LAWS, extra, inserted
from kbs_process.diagnosis.scene import Scene
from kbs_process.diagnosis.screen import Bench
from kbs_process.plant.effects.measured_law import COEFFICIENTS, spline

# Of a bump in the middle of the range, N m.
BUMP = np.array([0.0, 0.0, 0.02, 0.1, 0.3, 0.3, 0.1, 0.02, 0.0, 0.0])
DRAG = -0.02 * np.tanh(np.linspace(-2.0, 2.0, COEFFICIENTS))


def test_the_plants_spline_is_the_curves_and_holds_beyond_its_ends() -> None:
    rng = np.random.default_rng(3)
    coefficients = rng.standard_normal(COEFFICIENTS)
    x = rng.uniform(-1.0, 2.0, 200)
    one_by_one = [spline(float(at), -0.4, 1.1, *map(float, coefficients)) for at in x]
    np.testing.assert_allclose(basis(x, -0.4, 1.1) @ coefficients, one_by_one, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(basis(x, -0.4, 1.1).sum(axis=1), 1.0, rtol=1e-14)
    ends = basis(np.array([-0.4, -9.0, 1.1, 9.0]), -0.4, 1.1) @ coefficients
    assert ends[0] == ends[1] != ends[2] == ends[3]


def test_cubic_polynomials_are_such_curves() -> None:
    x = np.linspace(0.2, 0.9, 300)
    cubic = 1.0 - 3.0 * x + 2.0 * x**2 - 0.7 * x**3
    B = basis(x, 0.2, 0.9)
    np.testing.assert_allclose(B @ np.linalg.lstsq(B, cubic, rcond=None)[0], cubic, atol=1e-12)


@pytest.fixture(scope="module")
def scene() -> Scene:
    made = bench.experiment(bench.rig(), ("fit", "held-out"), 1)
    hypothesis = Hypothesis(made.rig, made.effects)
    return Scene.of(made, hypothesis, {0: predict(hypothesis, made, 0)})


def suspect(scene: Scene, law: tuple[str, str]) -> CurveSuspect:
    return next(c for c in curves(scene) if (c.port, c.regressor, c.joint) == (*law, "el"))


@pytest.mark.parametrize("law", list(LAWS))
def test_the_plant_with_it_shows_what_the_screen_expected(scene: Scene, law: tuple[str, str]) -> None:
    """At the encoder, and where the laboratory reacts it, about the axis at the transducer."""
    made, curve = scene.experiment, suspect(scene, law)
    ends = float(curve.knots[0]), float(curve.knots[-1])
    coefficients = DRAG if law[1] == "joint_rate" else BUMP
    hypothesis, scalars = inserted(scene.hypothesis, law, "el", ends, coefficients, 0.1 * coefficients)
    np.testing.assert_array_equal(hypothesis.values(scalars), coefficients)
    change = predict(hypothesis, made, 0).values - scene.predicted[0].values
    expected = bench_of(scene).signatures([curve], 0) @ coefficients
    for channel in ("el", "Ty") if law[0] == "ground_torque" else ("el",):
        c = made.channels.index(channel)
        seen, meant = (values[:, c] - values[:, c].mean() for values in (change, expected))
        assert np.linalg.norm(seen - meant) < 0.05 * np.linalg.norm(meant), channel


def bench_of(scene: Scene) -> Bench:
    """A bench of which nothing but experiment and scene is asked."""
    known = object.__new__(Known)
    object.__setattr__(known, "experiment", scene.experiment)
    return Bench(known, scene, None, ())  # type: ignore[arg-type]


def test_a_second_one_at_the_same_joint_has_names_of_its_own(scene: Scene) -> None:
    law = ("joint_torque", "joint_angle")
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
    for law in LAWS:
        hypothesis, _ = inserted(hypothesis, law, "el", (0.1, 0.9), BUMP, 0.1 * BUMP)
    known = campaign.rig.quantities()
    changed = {
        name: entry
        for name, entry in hypothesis.rig.quantities().items()
        if name not in known or entry.value.ndim > 1
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
    law, ends = ("ground_torque", "joint_angle"), (1.25, 1.30)
    nominal = Hypothesis(made.rig, made.effects)
    truth, _ = inserted(nominal, law, "el", ends, BUMP, 0.0 * BUMP)
    added = predict(truth, made, 0).values - predict(nominal, made, 0).values
    made = replace(
        made,
        trials=tuple(
            replace(trial, measured=trial.measured + added * trial.valid[:, None]) for trial in made.trials
        ),
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
    meant, shown = basis(x, *ends) @ BUMP, curve.basis(x) @ after.known.value[begin:]
    np.testing.assert_allclose(shown - shown.mean(), meant - meant.mean(), atol=0.02)
