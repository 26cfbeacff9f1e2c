"""Laws of the mounting: at which size one does what recordings show is asked of the plant itself."""

from __future__ import annotations

from dataclasses import replace

import bench
import numpy as np
import pytest
from test_rounds import ROLES, standing

from kbs_process.diagnosis.experiment import Experiment
from kbs_process.diagnosis.hypothesis import Hypothesis, Prediction, predict
from kbs_process.diagnosis.screen import Bench, Catalogued
from kbs_process.diagnosis.sizes import of_mounting, sized
from kbs_process.diagnosis.view import View
from kbs_process.plant.attach import attach
from kbs_process.plant.effects import find
from kbs_process.rig.model import TRANSDUCER
from kbs_process.signals.records import Array

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
        replace(trial, measured=trial.measured + (with_it - without) * trial.valid[:, None])
        for trial in made.trials
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
    assert (
        abs(amplitude_about(view, found.score.amplitude)["base_loop_y"]) < LOOP / 10.0
    )  # what rings on promises
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


def test_what_a_mounting_makes_is_right_beside_numbers_that_are(slipping: Experiment) -> None:
    """All that the law did is gained at the true size and shape, where these are among those tried."""
    view = of(slipping)
    known = view.standing.known
    excess = sum(float(z @ z) for z in view.bench.background.z.values()) - known.fit_rows
    found = next(one for one in view.screening.candidates if of_mounting(one))
    better = sized(view.bench, found, view.suspects, bench.serial(slipping))
    assert isinstance(view.bench, Bench) and better.score.gain > 0.5 * excess
