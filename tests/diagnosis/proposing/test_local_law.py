"""A law of a joint's angle: the residual says where it acts, or how often in a turn, between the places of any grid,
and the plant how wide it is.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from kbs_process.diagnosis.acceptance import verdict
from kbs_process.diagnosis.acceptance.plausible import implausible, undone
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, predict
from kbs_process.diagnosis.nominal.joint import Standing, with_extra
from kbs_process.diagnosis.proposing import proposals
from kbs_process.diagnosis.proposing.proposals import proposed
from kbs_process.diagnosis.proposing.tryout import extra_of
from kbs_process.diagnosis.screening.ranges import Ranges
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.diagnosis.screening.screen import Bench, Catalogued, screen
from kbs_process.diagnosis.screening.shapes import bettered
from kbs_process.diagnosis.screening.suspects import Candidate
from kbs_process.identification.output_error import Scalar
from kbs_process.plant.attach import attach
from kbs_process.plant.effect import Effect
from kbs_process.plant.laws import select
from kbs_process.plant.laws.hysteresis.cable import HARNESS
from kbs_process.plant.laws.position.bell import LOCAL_TORQUE
from kbs_process.plant.laws.position.detent import DETENT
from kbs_process.plant.laws.position.order import JOINT_ORDER

pytestmark = pytest.mark.slow

FREE = (Scalar("body.antenna.cog", (0,)), Scalar("joint.el.drive.Ka"))
TORQUE, ANGLE, WIDTH = 0.6, 1.27941, 1e-3  # N m, rad, rad: a fortieth of the swing


def with_bump(angle: float = ANGLE) -> Standing:
    """EL089's rig with a narrow local torque at elevation that nobody stated."""
    return with_law(LOCAL_TORQUE, {"local": TORQUE, "local_angle": angle, "local_width": WIDTH})


def with_law(law: Effect, values: dict[str, float]) -> Standing:
    """EL089's rig with a law at elevation that nobody stated."""
    made = bench.experiment(bench.rig(), ("fit", "fit"), 6)
    names = tuple(one.name for one in select([*made.effects, law.name]))
    truth = attach(made.rig, law, values, joints=["el"])
    bare = predict(Hypothesis(made.rig, made.effects), made, 0).values
    added = predict(Hypothesis(truth, names), made, 0).values - bare
    trials = tuple(replace(t, measured=t.measured + added * t.valid[:, None]) for t in made.trials)
    return bench.standing(replace(made, trials=trials), FREE)


@pytest.mark.parametrize("angle", [ANGLE, 1.2888])
def test_the_residual_says_where_a_law_acts(angle: float) -> None:
    here = with_bump(angle)
    scene = Scene.of(here.known.experiment, here.hypothesis, here.predicted)
    found = proposed(here.known, scene)
    for name in ("local", "detent", "touch", "shift"):
        places, (width,) = found[f"{name}_angle.el"], found[f"{name}_width.el"]
        print(name, places, width)
        assert min(abs(place - angle) for place in places) < WIDTH
        assert 0.2 * WIDTH < width < 4.0 * WIDTH


@pytest.mark.parametrize("order", [310.0, 367.3])
def test_the_residual_says_how_often_in_a_turn_a_law_comes_again(order: float) -> None:
    here = with_law(JOINT_ORDER, {"joint_sin": 0.2, "joint_cos": 0.1, "joint_order": order})
    scene = Scene.of(here.known.experiment, here.hypothesis, here.predicted)
    lines = proposed(here.known, scene)["joint_order.el"]
    print(lines)
    # A swing of 0.046 rad tells two orders apart that are 137 from each other.
    assert min(abs(line - order) for line in lines) < 10.0


def test_a_joint_too_fast_for_any_line_along_its_angle_has_none(monkeypatch: pytest.MonkeyPatch) -> None:
    here = with_bump()
    scene = Scene.of(here.known.experiment, here.hypothesis, here.predicted)
    to_and_fro = np.tile([0.0, 0.5], 200)
    passed = to_and_fro, np.random.default_rng(1).standard_normal((len(to_and_fro), 8))
    monkeypatch.setattr(proposals, "_passed", lambda *_: iter([passed]))
    assert "joint_order.el" not in proposed(here.known, scene)


@pytest.mark.parametrize("rest", [1.265, 1.288])
def test_a_spring_that_yields_away_from_the_middle_is_followed_there(rest: float) -> None:
    values = {"harness_taut": 0.5, "harness_middle": rest, "harness_reach": 4e-3, "harness_memory": 0.01}
    here = with_law(HARNESS, values)
    scene = Scene.of(here.known.experiment, here.hypothesis, here.predicted)
    tried = Bench.of(here.known, scene)
    ranges = Ranges({("el", "joint_angle"): (1.254, 1.3)}, {})
    shapes = {e.name: ranges.choices(e, "el", None) for e in HARNESS.parameters if e.role == "shape"}
    every = [
        Catalogued(Candidate(HARNESS, "el", tuple(zip(shapes, shape, strict=True))), scene)
        for shape in itertools.product(*shapes.values())
    ]
    best = bettered(tried, screen(tried, every).candidates[0])
    found = dict(best.suspect.candidate.shape)
    print(found, best.score.gain, here.known.excess)
    assert abs(found["harness_middle"] - rest) < 1e-3
    assert best.score.gain > 0.95 * here.known.excess


def test_a_bump_is_found_from_a_place_where_it_does_nothing() -> None:
    """Between the places of a grid a narrow law is out of a descent's sight: all of what a joint sweeps is tried."""
    here = with_bump()
    scene = Scene.of(here.known.experiment, here.hypothesis, here.predicted)
    tried = Bench.of(here.known, scene)

    def bump(angle: float, width: float) -> Catalogued:
        shape = (("local_angle", angle), ("local_width", width))
        return Catalogued(Candidate(LOCAL_TORQUE, "el", shape), scene)

    true = screen(tried, [bump(ANGLE, WIDTH)]).candidates[0].score.gain
    begun = screen(tried, [bump(1.257, WIDTH)]).candidates[0]
    best = bettered(tried, begun)
    found = dict(best.suspect.candidate.shape)
    print(found, begun.score.gain, best.score.gain, true)
    assert begun.score.gain < 0.1 * true
    assert abs(found["local_angle"] - ANGLE) < WIDTH
    assert best.score.gain > 0.95 * true


@pytest.mark.parametrize("beside", [-0.5, 0.5])
def test_a_detent_is_found_from_where_it_seems_to_be_wider(beside: float) -> None:
    """It is passed in less than what it makes ring takes to decay, and a wide one of the other sign does some of it."""
    true = {"detent_angle": 1.2745, "detent_width": 7e-4}
    here = with_law(DETENT, {"detent": -0.6, **true})
    scene = Scene.of(here.known.experiment, here.hypothesis, here.predicted)
    tried = Bench.of(here.known, scene)
    wide = 6.0 * true["detent_width"]
    shape = (("detent_angle", true["detent_angle"] + beside * wide), ("detent_width", wide))
    begun = screen(tried, [Catalogued(Candidate(DETENT, "el", shape), scene)]).candidates[0]
    best = bettered(tried, begun)
    assert isinstance(best.suspect, Catalogued)
    found = dict(best.suspect.candidate.shape)
    print(found, best.score.amplitude, begun.score.gain, best.score.gain, here.known.excess)
    assert begun.score.gain < 0.5 * here.known.excess
    assert best.score.gain > 0.9 * here.known.excess
    assert found["detent_angle"] == pytest.approx(true["detent_angle"], abs=0.1 * true["detent_width"])
    assert best.score.amplitude[0] == pytest.approx(-0.6, rel=0.1)


def test_amplitudes_that_undo_each_other_are_judged_by_what_they_do_together() -> None:
    values = {"harness_taut": 0.5, "harness_middle": 1.28, "harness_reach": 4e-3, "harness_memory": 0.01}
    here = with_law(HARNESS, values)
    scene = Scene.of(here.known.experiment, here.hypothesis, here.predicted)
    # Where it yields lies far beyond the swing: the tail is a constant there, which the offset takes away.
    shape = {"harness_middle": 1.9, "harness_reach": 0.1, "harness_memory": 0.01}
    suspect = Catalogued(Candidate(HARNESS, "el", tuple(shape.items())), scene)
    nothing = dict.fromkeys(suspect.amplitudes, 0.0)
    tail = nothing | {"harness_offset": -5e3, "harness_taut": 5e3}
    free = undone(suspect, tail)
    assert {"harness_offset", "harness_taut"} <= free
    known = {name: (value, 1.0) for name, value in tail.items()}
    assert implausible(HARNESS, known, free) == ()
    assert len(implausible(HARNESS, known)) == 2
    alone = nothing | {"harness_offset": -5e3}
    assert "harness_offset" not in undone(suspect, alone)
    # Two finds that are one law together: the second's numbers follow.
    values, shapes = (np.array([*own.values()] * 2, dtype=float) for own in (tail, shape))
    assert verdict._undone(suspect, values, shapes) == free


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
