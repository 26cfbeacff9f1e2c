"""Laws of the mounting: at which size one does what recordings show is asked of the plant itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from diagnosis.selection.test_rounds import ROLES, standing
from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.floor import declared
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, Prediction, predict
from kbs_process.diagnosis.experiments.thresholds import HIDDEN
from kbs_process.diagnosis.nominal.joint import standing_of
from kbs_process.diagnosis.nominal.known import Known, refit
from kbs_process.diagnosis.proposing.sizes import in_the_way, of_mounting, sized
from kbs_process.diagnosis.proposing.view import View
from kbs_process.diagnosis.screening.screen import Catalogued, Found
from kbs_process.diagnosis.selection import race, rounds
from kbs_process.diagnosis.selection.effort import Effort
from kbs_process.diagnosis.selection.leaders import leaders
from kbs_process.plant.attach import attach
from kbs_process.plant.laws import find
from kbs_process.rig.model import TRANSDUCER
from kbs_process.signals.records import Array

pytestmark = pytest.mark.validation

LOOP, ANGLE = 0.08, 3e-6  # N m about y, rad


@pytest.fixture(scope="module")
def slipping() -> Experiment:
    """Recordings of a rig whose mounting slips about y before the spring of the transducer holds it."""
    made = bench.experiment(bench.rig(), ROLES, 3)
    law = find("base_hysteresis")
    assert law is not None
    values = {"base_loop_y": LOOP, "base_slip_angle": ANGLE, "base_slip_power": 2.0}
    rig = attach(made.rig, law, values, on=TRANSDUCER, point=np.zeros(3))
    with_it = predict(Hypothesis(rig, (*made.effects, law.name)), replace(made, rig=rig), 0).values
    without = predict(Hypothesis(made.rig, made.effects), made, 0).values
    trials = tuple(
        replace(trial, measured=trial.measured + (with_it - without) * trial.valid[:, None]) for trial in made.trials
    )
    return replace(made, trials=trials)


def of(made: Experiment) -> View:
    return View.of(standing(made), lambda one: one.family[0] in ("base_hysteresis", "ground_cable"))


def amplitude_about(view: View, value: Array) -> dict[str, float]:
    found = next(one for one in view.screening.candidates if of_mounting(one))
    return dict(zip(found.suspect.amplitudes, value.tolist(), strict=True))


def test_a_slip_of_the_mounting_is_found_at_its_size(slipping: Experiment) -> None:
    view = of(slipping)
    found = next(one for one in view.screening.candidates if of_mounting(one))
    cable = next(one for one in view.screening.candidates if not of_mounting(one))
    assert isinstance(cable.suspect, Catalogued)
    better = sized(view.bench, found, view.suspects, bench.serial(slipping))
    assert better.suspect.family == found.suspect.family
    assert abs(amplitude_about(view, found.score.amplitude)["base_loop_y"]) < LOOP / 10.0  # what rings on promises
    told = amplitude_about(view, better.score.amplitude)
    assert told["base_loop_x"] == told["base_loop_z"] == 0.0
    assert LOOP / 3.0 < told["base_loop_y"] < 3.0 * LOOP
    assert better.score.gain > found.score.gain and better.log_evidence > found.log_evidence


def test_a_plant_that_diverges_or_does_no_better_leaves_the_screen_s_word(slipping: Experiment) -> None:
    view = of(slipping)
    found = next(one for one in view.screening.candidates if of_mounting(one))

    def diverged(tasks: list[tuple[int, Hypothesis]]) -> list[Prediction]:
        shown = view.standing.predicted[0]
        return [replace(shown, values=np.full_like(shown.values, np.nan)) for _ in tasks]

    assert sized(view.bench, found, view.suspects, diverged) is found
    much = replace(found, score=replace(found.score, gain=np.inf))
    assert sized(view.bench, much, view.suspects, bench.serial(slipping)) is much


def test_most_of_what_a_mounting_makes_is_gained_at_its_size(slipping: Experiment) -> None:
    """Beside known numbers that are right, at a shape and a size of the grid that are near the true ones."""
    view = of(slipping)
    excess = sum(float(z @ z) for z in view.bench.background.z.values()) - view.standing.known.fit_rows
    found = next(one for one in view.screening.candidates if of_mounting(one))
    better = sized(view.bench, found, view.suspects, bench.serial(slipping))
    assert better.score.gain > 0.8 * excess > found.score.gain


def test_where_no_moment_is_read_no_size_is_tried(slipping: Experiment) -> None:
    view = of(slipping)
    found = next(one for one in view.screening.candidates if of_mounting(one))
    blind = replace(slipping, channels=tuple(name.replace("T", "?") for name in slipping.channels))
    known = replace(view.bench.known, experiment=blind)
    there = replace(view.bench, known=known)
    assert sized(there, found, view.suspects, bench.serial(slipping)) is found


@pytest.mark.parametrize("much", [False, True])
def test_sizes_are_tried_where_much_is_left(slipping: Experiment, monkeypatch: pytest.MonkeyPatch, much: bool) -> None:
    view = of(slipping)
    known = view.standing.known
    if not much:
        known = replace(known, residual=tuple(0.01 * z for z in known.residual))
    assert known.gross == much
    view = replace(view, standing=replace(view.standing, known=known))
    asked: list[tuple[str, str]] = []

    def noted(_: object, found: Found, *__: object) -> Found:
        asked.append(found.suspect.family)
        return found

    monkeypatch.setattr(race, "sized", noted)
    simulate = Effort(bench.serial(slipping), known)
    race.raced(list(view.screening.candidates), view, declared(slipping), simulate)
    assert asked == [("base_hysteresis", TRANSDUCER)] * much


STIFF = {"windup_loss": 2.0, "windup_memory": 4e-5}  # five times the gear's own stiffness, where it sticks


@pytest.fixture(scope="module")
def sticking() -> Experiment:
    """Recordings of a rig whose gear winds up against friction that is stiffer than itself."""
    made = bench.experiment(bench.rig(), ROLES, 3)
    law = find("transmission_hysteresis")
    assert law is not None
    rig = attach(made.rig, law, STIFF, joints=["el"])
    with_it = predict(Hypothesis(rig, (*made.effects, law.name)), replace(made, rig=rig), 0).values
    without = predict(Hypothesis(made.rig, made.effects), made, 0).values
    trials = tuple(
        replace(trial, measured=trial.measured + (with_it - without) * trial.valid[:, None]) for trial in made.trials
    )
    return replace(made, trials=trials)


def test_a_gear_s_stiff_hysteresis_leads_at_its_size(sticking: Experiment) -> None:
    laws = ("transmission_hysteresis", "stribeck", "harness", "kinematic_error")
    view = View.of(standing(sticking), lambda one: one.family[0] in laws)
    found = next(one for one in view.screening.candidates if one.suspect.family == ("transmission_hysteresis", "el"))
    assert in_the_way(found.suspect)
    better = sized(view.bench, found, view.suspects, bench.serial(sticking))
    excess = sum(float(z @ z) for z in view.bench.background.z.values()) - view.standing.known.fit_rows
    print("screen", found.score.gain, "plant", better.score.gain, "of", excess, better.score.amplitude)
    assert better.score.gain > found.score.gain
    assert STIFF["windup_loss"] / 3.0 < float(better.score.amplitude[0]) < 3.0 * STIFF["windup_loss"]
    first, _ = leaders(view, bench.serial(sticking))
    assert first[0].suspect.family == found.suspect.family
    assert first[0].score.gain >= better.score.gain


def test_only_springs_in_a_drive_are_sized_there(sticking: Experiment) -> None:
    view = View.of(standing(sticking), lambda one: not one.each_trial)
    named = {one.suspect.family[0] for one in view.screening.candidates if in_the_way(one.suspect)}
    assert {"transmission_hysteresis", "dahl", "lugre", "joint_hysteresis", "backlash"} <= named
    assert not named & {"kinematic_error", "harness", "stribeck", "load_friction", "base_hysteresis", "cogging"}


def test_a_spring_that_numbers_had_taken_up_is_looked_for_where_the_files_have_them(
    sticking: Experiment, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Refitted without it, numbers had taken up half; beside those that are near the files' all is its own."""
    begun, floor = standing(sticking), declared(sticking)
    simulate = Effort(bench.serial(sticking), begun.known)
    refitted = refit(sticking, begun.hypothesis, floor, simulate, reach=4.0, leaps=0)
    pulled = standing_of(refitted, {})
    assert pulled.known.excess < 0.6 * begun.known.excess
    seen = View.of(pulled, lambda one: False)
    assert pulled.known.strained
    monkeypatch.setattr(Known, "strained", False)
    assert rounds._hidden(seen, pulled, floor, simulate, []) == []
    monkeypatch.undo()
    every = rounds._hidden(seen, pulled, floor, simulate, [])
    assert len(every) <= HIDDEN
    law = next(one for one in every if one.found.suspect.family == ("transmission_hysteresis", "el"))
    print("left", pulled.known.excess, "with it", law.standing.known.excess, "of", law.standing.known.fit_rows)
    assert law.standing.known.excess < 0.02 * pulled.known.excess
