"""A force whose point nobody knows: the screen tries a few, and the fit in the plant finds it from the wrench."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, predict
from kbs_process.diagnosis.nominal.joint import Standing, with_extra
from kbs_process.diagnosis.nominal.parameters import known_parameters, prior
from kbs_process.diagnosis.proposing.tryout import extra_of, identity
from kbs_process.diagnosis.proposing.view import View
from kbs_process.diagnosis.screening.ranges import Ranges
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.diagnosis.screening.screen import Bench, Catalogued, screen
from kbs_process.diagnosis.screening.shapes import bettered
from kbs_process.diagnosis.screening.suspects import Candidate, candidates, points_of
from kbs_process.diagnosis.selection.leaders import leaders
from kbs_process.identification.output_error import Scalar
from kbs_process.plant.attach import attach
from kbs_process.plant.effect import Effect
from kbs_process.plant.laws import select
from kbs_process.plant.laws.environment.air_drag import AIR_DRAG
from kbs_process.plant.laws.environment.bungee import BUNGEE
from kbs_process.plant.predict import Schedule

pytestmark = pytest.mark.slow

DRAG, POWER, POINT = 0.8, 1.75, np.array([0.3, -0.1, 0.12])  # N at 0.01 m/s, 1, m
FREE = (Scalar("body.antenna.cog", (0,)), Scalar("joint.el.drive.Ka"))


def pulled(
    effect: Effect, values: Mapping[str, float], path: Callable[[float], Schedule] = bench.schedule
) -> tuple[Experiment, Standing]:
    """EL089's rig, and what is believed where a force that nobody stated acts on its antenna, at `POINT`."""
    made = bench.experiment(bench.rig(), ("fit", "fit"), 5, path=path)
    names = tuple(one.name for one in select([*made.effects, effect.name]))
    truth = attach(made.rig, effect, values, on="el", point=POINT)
    bare = predict(Hypothesis(made.rig, made.effects), made, 0).values
    added = predict(Hypothesis(truth, names), made, 0).values - bare
    trials = tuple(replace(t, measured=t.measured + added * t.valid[:, None]) for t in made.trials)
    return made, bench.standing(replace(made, trials=trials), FREE)


def test_the_point_of_a_drag_is_found_beside_its_size_and_power() -> None:
    made, here = pulled(AIR_DRAG, {"air_drag": DRAG, "air_drag_power": POWER})
    scene = Scene.of(here.known.experiment, here.hypothesis, here.predicted)
    tried = Bench.of(here.known, scene)
    every = [
        Candidate(AIR_DRAG, site, (("air_drag_power", 2.0),), point)
        for site in ("az", "el")
        for point in points_of(AIR_DRAG, made.rig, site)
    ]
    best = bettered(tried, screen(tried, [Catalogued(one, scene) for one in every]).candidates[0])
    own = identity(best.suspect)
    assert (own.place.port, own.place.site, own.family) == ("external wrench", "el", "air drag")
    assert AIR_DRAG.port_word == "external wrench"
    after = with_extra(here, extra_of(best, here, tried, scene), bench.serial(made)).known
    found = {s.name.removeprefix("external.air_drag."): k for k, s in enumerate(after.free)}
    # A short swing tells size from distance by a few percent: the search ends where little more is to be gained.
    expected = {"air_drag": (DRAG, 0.25), "air_drag_power": (POWER, 0.05)}
    expected |= {f"point[{k}]": (POINT[k], 0.04) for k in range(3)}
    for name, (value, near) in expected.items():
        number = after.value[found[name]]
        print(f"{name}: {number:.4f} +- {after.sigma[found[name]]:.4f}, true {value}")
        assert number == pytest.approx(value, abs=near)
    assert after.level < 1.1 < 100.0 < here.known.level


def test_a_cord_that_nobody_stated_is_found_wherever_its_anchor_is() -> None:
    cord = {"stiffness": 3.0, "free_length": 0.8, "anchor_x": 0.45, "anchor_y": -0.3, "anchor_z": 1.3}
    made, here = pulled(BUNGEE, cord)
    scene = Scene.of(here.known.experiment, here.hypothesis, here.predicted)
    tried = Bench.of(here.known, scene)
    none = Ranges({})
    every = [one for one in candidates(made.rig, made.effects, none, (), made.channels) if one.name == BUNGEE.name]
    best = bettered(tried, screen(tried, [Catalogued(one, scene) for one in every]).candidates[0])
    own = identity(best.suspect)
    assert (own.place.port, own.place.site, own.family) == ("external wrench", "el", "bungee")
    after = with_extra(here, extra_of(best, here, tried, scene), bench.serial(made)).known
    for name, value, sigma in zip(after.names, after.value, after.sigma, strict=True):
        print(f"{name}: {value:.4f} +- {sigma:.4f}")
    assert after.level < 1.1 < 5.0 < here.known.level


def wide(seconds: float) -> Schedule:
    """Both joints swing by half a radian."""
    t = np.arange(0.0, seconds + 0.1, 0.1)
    rate = np.stack([0.12 * np.sin(2 * np.pi * t / 16.0), -0.1 * np.sin(2 * np.pi * t / 12.0)], axis=1)
    position = np.array([-0.1, 1.3]) + 0.1 * np.cumsum(rate, axis=0)
    return Schedule(t, position, rate, field=100.0 * position)


def test_a_cord_whose_pull_is_a_weight_to_known_numbers_is_a_lead() -> None:
    """Wherever its grid has it, more than 99 % of what it does is masses' and levers'; what is left is its way's."""
    cord = {"stiffness": 6.0, "free_length": 0.4, "anchor_x": 0.3, "anchor_y": -0.2, "anchor_z": 1.2}
    made, here = pulled(BUNGEE, cord, wide)
    known = known_parameters(made.rig, made.effects)
    stated = np.isfinite(prior(made.rig, made.rig, made.effects, known).sigma)
    free = tuple(one for one, told in zip(known, stated, strict=True) if told)  # all but phases
    here = bench.standing(here.known.experiment, free)
    scene = Scene.of(here.known.experiment, here.hypothesis, here.predicted)
    tried = Bench.of(here.known, scene)
    every = tuple(
        Catalogued(one, scene)
        for one in candidates(made.rig, made.effects, Ranges({}), (), made.channels)
        if one.name in ("bungee", "tether", "air_drag")
    )
    view = View(here, tried, scene, every, screen(tried, every))
    covered = next(one for one in view.screening.candidates if one.suspect.family == ("bungee", "el"))
    assert covered.score.rank == 0 and not covered.significant
    first, _ = leaders(view, bench.serial(made))
    print([(one.suspect.family, one.score.gain) for one in first])
    assert first[0].suspect.family == ("bungee", "el")
    assert first[0].score.gain > 2.0 * max(one.score.gain for one in view.able)
