"""A ripple that is no sine: its orders are found together, and are put into the plant as actions of one law."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from kbs_process.diagnosis.acceptance.outcome import Find
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, predict
from kbs_process.diagnosis.facts import Estimate, Identity
from kbs_process.diagnosis.nominal.joint import with_extra
from kbs_process.diagnosis.proposing.orders import _of_order, _others, with_orders
from kbs_process.diagnosis.proposing.tryout import extra_of, identity
from kbs_process.diagnosis.proposing.view import View
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.diagnosis.screening.screen import Bench, Catalogued, Found, screen
from kbs_process.diagnosis.screening.suspects import Candidate
from kbs_process.diagnosis.selection.as_suspect import suspect_of
from kbs_process.identification.output_error import Scalar
from kbs_process.plant.attach import attach
from kbs_process.plant.laws import find, select

pytestmark = pytest.mark.slow

GRID = (150.0, 250.0, 350.0, 500.0, 620.0, 750.0, 900.0)
RIPPLE = {250.0: 0.3, 500.0: -0.2, 750.0: 0.15}  # N m, sines


@pytest.fixture(scope="module")
def view() -> View:
    """What is believed where the elevation has a ripple of three orders, and its orders alone are suspects."""
    made = bench.experiment(bench.rig(), ("fit", "fit"), 8)
    names = ["joint_order", "joint_order_2", "joint_order_3"]
    truth = made.rig
    for effect, (order, size) in zip(select(names), RIPPLE.items(), strict=True):
        sine, cosine, shape = (entry.name for entry in effect.parameters)
        truth = attach(truth, effect, {sine: size, cosine: 0.0, shape: order}, joints=["el"])
    bare = predict(Hypothesis(made.rig, made.effects), made, 0).values
    added = predict(Hypothesis(truth, (*made.effects, *names)), made, 0).values - bare
    trials = tuple(replace(t, measured=t.measured + added * t.valid[:, None]) for t in made.trials)
    here = bench.standing(replace(made, trials=trials), (Scalar("body.antenna.cog", (0,)),))
    scene = Scene.of(here.known.experiment, here.hypothesis, here.predicted)
    along = Bench.of(here.known, scene)
    law = find("joint_order")
    assert law is not None
    suspects = tuple(Catalogued(Candidate(law, "el", (("joint_order", order),)), scene) for order in GRID)
    return View(here, along, scene, suspects, screen(along, suspects))


def test_all_orders_are_found_and_no_other(view: View) -> None:
    (alone,) = view.screening.candidates
    whole = with_orders(view, alone)
    assert isinstance(whole.suspect, Catalogued)
    print(view.standing.known.level, alone.score.gain, whole.score.gain)
    assert orders_of(whole) == sorted(RIPPLE)
    assert whole.score.gain > 1.2 * alone.score.gain
    assert whole.log_evidence > alone.log_evidence
    assert identity(whole.suspect) == identity(alone.suspect)


def test_harmonics_of_an_order_are_found_that_residuals_did_not_propose(view: View) -> None:
    (alone,) = view.screening.candidates
    assert orders_of(alone) == [750.0]
    assert orders_of(with_orders(replace(view, suspects=(alone.suspect,)), alone)) == sorted(RIPPLE)


def test_a_tone_has_harmonics_up_to_what_is_looked_at(view: View) -> None:
    law = find("controller_jitter")
    assert law is not None
    own = Catalogued(Candidate(law, "el", (("jitter_frequency", 0.9),)), view.scene)
    found = sorted(_others(replace(view, suspects=(own,)), own))
    assert {0.45, 1.8, 2.7} <= {round(value, 9) for value in found}
    assert 7.0 < found[-1] <= view.standing.known.experiment.highest_Hz
    vibration = find("floor_vibration")
    assert vibration is not None  # its tone is each recording's own
    tone = Candidate(vibration, "", (("floor_frequency", 0.9), ("floor_sweep", 0.0)))
    assert _others(view, Catalogued(tone, view.scene)) == []


def test_what_comes_again_after_some_cycles_has_all_harmonics_of_that(view: View) -> None:
    """One cycle in 23 that comes late has lines at all of these, and the strongest may be the fifth."""
    law, controller = find("controller_jitter"), view.standing.known.experiment.rig.controller
    assert law is not None and controller is not None
    first = 1.0 / (23.0 * float(controller.cycle))
    own = Catalogued(Candidate(law, "el", (("jitter_frequency", 5.0 * first),)), view.scene)
    found = _others(replace(view, suspects=(own,)), own)
    highest = view.standing.known.experiment.highest_Hz
    wanted = [k * first for k in range(1, 24) if k != 5 and k * first <= highest]
    assert len(wanted) > 3
    assert all(min(abs(one - value) for one in found) < 1e-9 for value in wanted)


def orders_of(found: Found) -> list[float]:
    assert isinstance(found.suspect, Catalogued)
    return sorted(value for action in found.suspect.candidate.actions for _, value in action.shape)


def test_in_the_plant_each_has_its_size(view: View) -> None:
    whole = with_orders(view, view.screening.candidates[0])
    assert isinstance(whole.suspect, Catalogued)
    extra = extra_of(whole, view.standing, view.bench, view.scene)
    after = with_extra(view.standing, extra, bench.serial(view.standing.known.experiment)).known
    assert after.level < 1.02 < 1.2 < view.standing.known.level
    numbers = dict(zip(after.names, after.value, strict=True))
    sigmas = dict(zip(after.names, after.sigma, strict=True))
    for action in whole.suspect.candidate.actions:
        sine, cosine = (f"joint.el.drive.{entry.name}" for entry in action.amplitudes)
        ((_, order),) = action.shape
        assert abs(numbers[sine] - RIPPLE[order]) < 5.0 * sigmas[sine]
        assert abs(numbers[cosine]) < 5.0 * sigmas[cosine]
        assert sigmas[sine] < 0.2 * abs(RIPPLE[order])


def test_noise_has_no_orders(view: View) -> None:
    """Beside a residual that is the floor's, as beside one that is large and has none."""
    rng = np.random.default_rng(1)
    found = view.screening.candidates[0]
    for size in (1.0, 30.0):
        z = {k: size * rng.standard_normal(len(one)) for k, one in view.bench.background.z.items()}
        noisy = replace(view.bench, background=replace(view.bench.background, z=z))
        best = screen(noisy, view.suspects).candidates[0]
        assert with_orders(replace(view, bench=noisy), replace(found, score=best.score)).suspect is found.suspect


def test_the_rest_of_a_shape_is_the_suspect_s_own(view: View) -> None:
    law = find("friction_ripple")
    assert law is not None
    grid = [
        Catalogued(Candidate(law, "el", (("ripple_order", order), ("ripple_rate", 0.05))), view.scene)
        for order in (1.0, 2.0)
    ]
    own = replace(grid[0], candidate=replace(grid[0].candidate, shape=(("ripple_order", 1.0), ("ripple_rate", 0.2))))
    other = replace(grid[0], candidate=replace(grid[0].candidate, site="az", shape=(("ripple_order", 7.0),)))
    orders = _others(replace(view, suspects=(*grid, other)), own)
    assert orders == [2.0]
    assert _of_order(own, orders[0]).candidate.shape == (("ripple_order", 2.0), ("ripple_rate", 0.2))


@pytest.mark.parametrize("first", [0, 1])
def test_a_find_of_several_orders_is_such_a_suspect_again(view: View, first: int) -> None:
    """Also one whose first action was another find's."""
    whole = with_orders(view, view.screening.candidates[0])
    assert isinstance(whole.suspect, Catalogued)
    actions = whole.suspect.candidate.actions[first:]
    told = []
    for action in actions:
        size = 0.01 * action.shape[0][1]
        told += [Estimate(entry.name, "N m", size, 0.01) for entry in action.amplitudes]
        told += [Estimate(name, "1", value, 0.0) for name, value in action.shape]
    find_ = object.__new__(Find)
    for name, value in {"identity": identity(whole.suspect), "estimates": tuple(told), "curve": None}.items():
        object.__setattr__(find_, name, value)
    found = suspect_of(find_, view.scene)
    assert found is not None
    again, amplitude = found
    assert isinstance(again, Catalogued)
    assert [one.shape[0][1] for one in again.candidate.actions] == [one.shape[0][1] for one in actions]
    assert len(again.amplitudes) == 2 * len(actions)
    assert amplitude == pytest.approx(np.repeat([0.01 * one.shape[0][1] for one in actions], 2))


def test_orders_that_come_with_electrical_cycles_are_the_motor_s_own(view: View) -> None:
    """A hybrid stepper's poles and teeth make such a ripple, its rotor's eccentricity or a gear any other."""
    law = find("motor_order")

    def of(*orders: float) -> Identity:
        first, *more = [Candidate(law, "el", (("order", order),)) for order in orders]
        return identity(Catalogued(replace(first, again=tuple(more)), view.scene))

    drive = view.scene.hypothesis.rig.joint("el").drive
    assert drive is not None
    cycles = float(drive.parameters["Kangle"])
    assert of(cycles).family == of(2.0 * cycles, 3.0 * cycles).family == "cogging"
    for others in ((1.0,), (0.5 * cycles,), (cycles + 0.25,), (4.0 * cycles + 0.25,), (cycles, 7.0)):
        assert of(*others).family == "motor order"
    # They are one law all the same, of which one may be found after the other.
    assert of(cycles) == of(7.0)
