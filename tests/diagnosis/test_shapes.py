"""Which shapes of the catalogue's laws slopes can better, and how far they go."""

from __future__ import annotations

import numpy as np
import pytest
from test_suspects import rig, suspects

from kbs_process.diagnosis.shapes import Bend, bends
from kbs_process.plant.effect import LogNormal


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
    assert found["harness"] == {"harness_reach", "harness_memory"}
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
