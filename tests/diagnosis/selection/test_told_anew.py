"""A law of the readings is told anew until that changes little: from the wrong shape it comes to the right one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from diagnosis.selection.test_rounds import candidate, standing
from kbs_process.diagnosis.acceptance.finding import Tried
from kbs_process.diagnosis.acceptance.verdict import gated
from kbs_process.diagnosis.experiments.floor import declared
from kbs_process.diagnosis.nominal.joint import with_extra
from kbs_process.diagnosis.proposing.tryout import extra_of
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.diagnosis.screening.screen import Bench, Catalogued, screen
from kbs_process.diagnosis.selection.leaders import reread
from kbs_process.diagnosis.selection.race import own_of

pytestmark = pytest.mark.slow


def test_a_step_told_at_the_wrong_load_is_found_where_it_is() -> None:
    made = bench.experiment(bench.rig(), ("fit", "fit", "held-out"), 8)
    before = standing(made)
    scene = Scene.of(made, before.hypothesis, before.predicted, linear=False)
    assert not scene.paths
    reading = np.concatenate(
        [before.predicted[drive].values[:, made.channels.index("Ty")] for drive in before.predicted]
    )
    load, width = np.quantile(reading, 0.63), 0.01 * np.ptp(reading)
    size = 0.3 * np.ptp(reading)

    def law(at: float) -> Catalogued:
        return Catalogued(candidate("channel_step", "Ty", jump_load=at, jump_width=width), scene)

    added = size * Bench.of(before.known, scene).signatures([law(float(load))], 0)[:, :, 0]
    trials = tuple(replace(t, measured=t.measured + added * t.valid[:, None]) for t in made.trials)
    here = standing(replace(made, trials=trials))
    tried = Bench.of(here.known, Scene.of(here.known.experiment, here.hypothesis, here.predicted))
    wrong = screen(tried, [law(float(load - 0.1 * np.ptp(reading)))])
    floor, simulate = declared(made), bench.serial(made)
    after = with_extra(here, extra_of(wrong.candidates[0], here, tried, tried.scene), simulate)
    own = own_of(wrong.candidates[0], here, after)
    chosen = Tried(wrong.candidates[0], after, gated(wrong.candidates[0], here, after, own, simulate), wrong, own)
    told = reread(chosen, here, floor, simulate)
    assert isinstance(told.found.suspect, Catalogued)
    shape = dict(told.found.suspect.candidate.shape)
    assert told.found.suspect.candidate.name == "channel_step"
    assert shape["jump_load"] == pytest.approx(load, abs=2.0 * width)
    assert told.standing.known.cost < 0.1 * chosen.standing.known.cost
    assert told.standing.known.cost == pytest.approx(before.known.cost, rel=0.05)
