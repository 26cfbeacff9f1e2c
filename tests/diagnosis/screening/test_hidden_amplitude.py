"""A law's amplitude may be as large as its bounds are: that holds what recordings do not show, and nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, predict
from kbs_process.diagnosis.nominal.joint import Extra, Standing, with_extra
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.diagnosis.proposing.tryout import extra_of
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.diagnosis.screening.screen import Bench, Catalogued, screen
from kbs_process.diagnosis.screening.suspects import Candidate
from kbs_process.identification.output_error import Scalar
from kbs_process.plant.attach import attach
from kbs_process.plant.laws.hysteresis.cable import GROUND_CABLE
from kbs_process.plant.laws.transducer.step import CHANNEL_STEP

pytestmark = pytest.mark.slow

SHAPE = (("cable_middle", 0.0), ("cable_reach", 0.05), ("cable_memory", 0.02))


@pytest.fixture(scope="module")
def made() -> Experiment:
    return bench.experiment(bench.rig(), ("fit", "fit"), 6)


def tried(made: Experiment, candidate: Candidate) -> tuple[Standing, Extra]:
    """What is believed without a law, and its numbers."""
    here = bench.standing(made, (Scalar("body.antenna.cog", (0,)),))
    scene = Scene.of(made, here.hypothesis, here.predicted)
    along = Bench.of(here.known, scene)
    (found,) = screen(along, [Catalogued(candidate, scene)]).candidates
    return here, extra_of(found, here, along, scene)


def refitted(here: Standing, extra: Extra) -> Known:
    return with_extra(here, extra, bench.serial(here.known.experiment)).known


def test_a_step_beyond_all_loads_has_its_bounds_for_an_interval(made: Experiment) -> None:
    (most,) = (entry.bounds[1] for entry in CHANNEL_STEP.parameters if entry.role == "amplitude")
    candidate = Candidate(CHANNEL_STEP, "Ty", (("jump_load", 1e6), ("jump_width", 1e-3)))
    here, extra = tried(made, candidate)
    after = refitted(here, extra)
    place = len(here.known.value)
    assert after.value[place] == 0.0
    assert after.sigma[place] == pytest.approx(most, rel=1e-6)
    np.testing.assert_allclose(after.value[:place], here.known.value, rtol=1e-9)


def test_what_recordings_show_is_as_it_would_be_without(made: Experiment) -> None:
    truth = attach(made.rig, GROUND_CABLE, dict(SHAPE) | {"cable_spring": 2.0}, joints=["az"])
    names = (*made.effects, GROUND_CABLE.name)
    bare = predict(Hypothesis(made.rig, made.effects), made, 0).values
    added = predict(Hypothesis(truth, names), made, 0).values - bare
    trials = tuple(replace(t, measured=t.measured + added * t.valid[:, None]) for t in made.trials)
    here, extra = tried(replace(made, trials=trials), Candidate(GROUND_CABLE, "az", SHAPE))
    wide = np.abs([p.bounds for p in GROUND_CABLE.parameters if p.role == "amplitude"]).max(axis=1)
    np.testing.assert_array_equal(extra.sigma[: len(wide)], wide)
    free = np.where(np.arange(len(extra.sigma)) < len(wide), np.inf, extra.sigma)
    held, loose = refitted(here, extra), refitted(here, replace(extra, sigma=free))
    assert held.level < 1.1 < 2.0 < here.known.level
    apart = np.abs(held.value - loose.value) / loose.sigma
    assert apart.max() < 0.1
