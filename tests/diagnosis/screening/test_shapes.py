"""Which shapes of the catalogue's laws slopes can better, and how far they go."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from diagnosis.screening.test_suspects import rig, suspects
from diagnosis.selection.test_rounds import candidate, standing
from kbs_process.diagnosis.acceptance.finding import Tried, as_it_stands, find_of
from kbs_process.diagnosis.acceptance.gate import gate
from kbs_process.diagnosis.nominal.joint import Own, with_extra
from kbs_process.diagnosis.proposing.tryout import extra_of
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.diagnosis.screening.screen import Bench, Catalogued, Screening, screen
from kbs_process.diagnosis.screening.shapes import Bend, bends, bettered
from kbs_process.plant.effect import LogNormal

pytestmark = pytest.mark.slow


def test_steps_of_a_shape_stay_between_its_bounds_and_are_undone() -> None:
    for suspect in suspects(temperature=True, field_recorded=False):
        entries = {entry.name: entry for entry in suspect.effect.parameters}
        for one in bends(suspect, rig()):
            assert one.moved(0.0) == one.value
            down, up = one.room
            assert down <= 0.0 <= up
            for steps in (max(down, -0.3), min(up, 0.3)):
                value = one.moved(steps)
                assert one.low <= value <= one.high
                away = np.log(value / one.value) if one.ratio else value - one.value
                assert away / one.step == pytest.approx(steps, abs=1e-9)
            if not one.element:
                entry = entries[one.name]
                assert one.value == dict(suspect.shape)[one.name]
                assert entry.bounds[0] <= one.low < one.high <= entry.bounds[1]
                assert one.ratio == isinstance(entry.prior, LogNormal)


def test_whole_numbers_tones_phases_and_middles_of_series_stay() -> None:
    found: dict[str, set[str]] = {}
    for suspect in suspects(temperature=True, field_recorded=False):
        found.setdefault(suspect.name, set()).update(one.name for one in bends(suspect, rig()))
    assert found["motor_order"] == found["floor_vibration"] - {"floor_sweep"} == set()
    assert found["encoder_interpolation"] == found["channel_nonlinearity"] == set()
    assert found["harness"] == {"harness_middle", "harness_reach", "harness_memory"}
    assert found["local_torque"] == {"local_angle", "local_width"}
    assert found["channel_lag"] == {"lag_time"}
    assert found["tether"] == set()  # it acts at the CoG
    assert found["air_drag"] == {"air_drag_power", "point"}
    assert found["bungee"] == {"free_length", "anchor_x", "anchor_y", "anchor_z", "point"}


def test_a_place_has_no_prior_and_a_width_keeps_its_own() -> None:
    bump = next(s for s in suspects() if s.name == "local_torque")
    place, width = bends(bump, rig())
    assert place.size == width.value and place.sigma == np.inf
    assert width.sigma == width.value  # a logarithm known to one
    assert Bend("x", 2.0, 0.5, 1.0, 3.0).room == (-2.0, 2.0)


def test_the_time_of_a_lag_is_found_between_the_grid_s_with_its_interval() -> None:
    made = bench.experiment(bench.rig(), ("fit", "fit", "held-out"), 8)
    before = standing(made)
    scene = Scene.of(made, before.hypothesis, before.predicted)
    # A quarter of Ty comes 0.9 s late; the screen tries 0.5 and 2 s.
    truth = Catalogued(candidate("channel_lag", "Ty", lag_time=0.9), scene)
    added = 0.25 * Bench.of(before.known, scene).signatures([truth], 0)[:, :, 0]
    trials = tuple(replace(t, measured=t.measured + added * t.valid[:, None]) for t in made.trials)
    here = standing(replace(made, trials=trials))
    scene = Scene.of(here.known.experiment, here.hypothesis, here.predicted)
    tried = Bench.of(here.known, scene)
    grid = [Catalogued(candidate("channel_lag", "Ty", lag_time=time), scene) for time in (0.1, 0.5, 2.0)]
    coarse = screen(tried, grid).candidates[0]
    found = bettered(tried, coarse)
    assert isinstance(found.suspect, Catalogued)
    assert dict(found.suspect.candidate.shape)["lag_time"] == pytest.approx(0.9, rel=0.2)
    assert found.score.gain > coarse.score.gain
    for one in (coarse, found):
        after = with_extra(here, extra_of(one, here, tried, scene), bench.serial(made))
        own = Own(after.known.names[-2:], after.known.names[-2:-1])
        told = find_of(
            [Tried(one, after, gate(here.known, after.known, [-2]), Screening((one,)), own)], np.ones(1), here, None
        )
        lag, time = told.estimates
        print(lag, time)
        assert (lag.name, time.name, time.unit) == ("lag_share", "lag_time", "s")
        assert time.sigma > 0.0
        assert as_it_stands(told, own, after.known).estimates == told.estimates
    assert time.low < 0.9 < time.high and lag.low < 0.25 < lag.high


def test_a_shape_is_found_for_what_each_recording_has_an_amount_of() -> None:
    made = bench.experiment(bench.rig(), ("fit", "fit"), 9)
    before = standing(made)
    scene = Scene.of(made, before.hypothesis, before.predicted)
    truth = Catalogued(candidate("clock_wander", "encoder", wander_period=9.5), scene)
    unit = Bench.of(before.known, scene).signatures([truth], 0)
    trials = tuple(
        replace(t, measured=t.measured + (unit @ amounts) * t.valid[:, None])
        for t, amounts in zip(made.trials, ([0.05, 0.02], [-0.03, 0.04]), strict=True)
    )
    here = standing(replace(made, trials=trials))
    scene = Scene.of(here.known.experiment, here.hypothesis, here.predicted)
    tried = Bench.of(here.known, scene)
    grid = [Catalogued(candidate("clock_wander", "encoder", wander_period=p), scene) for p in (8.0, 12.0)]
    coarse = screen(tried, grid).candidates[0]
    found = bettered(tried, coarse)
    assert isinstance(found.suspect, Catalogued)
    assert dict(found.suspect.candidate.shape)["wander_period"] == pytest.approx(9.5, rel=0.05)
    assert found.score.gain > coarse.score.gain > 100.0
    assert found.score.amplitude == pytest.approx([0.05, 0.02, -0.03, 0.04], abs=0.01)
