"""A law at one place of a joint: the residual says where, between the places of any grid, and the plant how wide."""

from __future__ import annotations

from dataclasses import replace

import bench
import pytest

from kbs_process.diagnosis.hypothesis import Hypothesis, predict
from kbs_process.diagnosis.joint import Standing, with_extra
from kbs_process.diagnosis.proposals import proposed
from kbs_process.diagnosis.ranges import Ranges
from kbs_process.diagnosis.scene import Scene
from kbs_process.diagnosis.screen import Bench, Catalogued, screen
from kbs_process.diagnosis.shapes import bettered
from kbs_process.diagnosis.suspects import Candidate
from kbs_process.diagnosis.tryout import extra_of
from kbs_process.plant.attach import attach
from kbs_process.plant.effects import select
from kbs_process.plant.effects.local_torque import LOCAL_TORQUE
from kbs_process.stages.output_error import Scalar

FREE = (Scalar("body.antenna.cog", (0,)), Scalar("joint.el.drive.Ka"))
TORQUE, ANGLE, WIDTH = 0.6, 1.27941, 1e-3  # N m, rad, rad: a fortieth of the swing


def with_bump(angle: float = ANGLE) -> Standing:
    """EL089's rig with a narrow local torque at elevation that nobody stated."""
    made = bench.experiment(bench.rig(), ("fit", "fit"), 6)
    names = tuple(one.name for one in select([*made.effects, LOCAL_TORQUE.name]))
    values = {"local": TORQUE, "local_angle": angle, "local_width": WIDTH}
    truth = attach(made.rig, LOCAL_TORQUE, values, joints=["el"])
    bare = predict(Hypothesis(made.rig, made.effects), made, 0).values
    added = predict(Hypothesis(truth, names), made, 0).values - bare
    trials = tuple(replace(t, measured=t.measured + added * t.valid[:, None]) for t in made.trials)
    return bench.standing(replace(made, trials=trials), FREE)


@pytest.mark.parametrize("angle", [ANGLE, 1.2888])
def test_the_residual_says_where_a_law_acts(angle: float) -> None:
    here = with_bump(angle)
    scene = Scene.of(here.known.experiment, here.hypothesis, here.predicted)
    found = proposed(here.known, scene)
    for name in ("local", "touch", "shift"):
        places, (width,) = found[f"{name}_angle.el"], found[f"{name}_width.el"]
        print(name, places, width)
        assert min(abs(place - angle) for place in places) < WIDTH
        assert 0.2 * WIDTH < width < 4.0 * WIDTH


def test_place_and_width_of_a_bump_are_found_in_the_plant() -> None:
    here = with_bump()
    scene = Scene.of(here.known.experiment, here.hypothesis, here.predicted)
    tried = Bench.of(here.known, scene)
    span = {("el", "joint_angle"): (1.254, 1.3)}
    ranges = Ranges(span, proposed(here.known, scene))
    angle, width = (
        next(e for e in LOCAL_TORQUE.parameters if e.name == f"local_{what}") for what in ("angle", "width")
    )
    every = [
        Catalogued(Candidate(LOCAL_TORQUE, "el", (("local_angle", place), ("local_width", wide))), scene)
        for place in ranges.choices(angle, "el", None)
        for wide in ranges.choices(width, "el", None)
    ]
    best = bettered(tried, screen(tried, every).candidates[0])
    after = with_extra(here, extra_of(best, here, tried, scene), bench.serial(here.known.experiment)).known
    names = [scalar.name.rpartition(".")[2] for scalar in after.free]
    for name, value in {"local": TORQUE, "local_angle": ANGLE, "local_width": WIDTH}.items():
        number, sigma = after.value[names.index(name)], after.sigma[names.index(name)]
        print(f"{name}: {number:.5f} +- {sigma:.5f}, true {value}")
        assert abs(number - value) < 4.0 * sigma + 1e-3 * value
    assert after.level < 1.1 < here.known.level
