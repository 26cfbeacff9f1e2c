"""Commands with gaps, held ends, recorded fields and recorded encoders."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kbs_process.errors import SimulationError
from kbs_process.plant.schedule import Schedule, covering
from plant.plant_rigs import NOMINAL, streams, two_axis

SETTINGS = {"rate_Hz": 100.0, "angle_rate_Hz": 10.0, "duration_s": 6.0}


def sweep(duration: float = 6.0) -> Schedule:
    t = 0.1 * np.arange(round(duration / 0.1) + 1)
    position = np.stack([0.2 * np.sin(0.5 * t), 1.3 + 0.05 * (1 - np.cos(0.7 * t))], axis=1)
    rate = np.stack([0.1 * np.cos(0.5 * t), 0.035 * np.sin(0.7 * t)], axis=1)
    return Schedule(t, position, rate)


def test_lost_cycles_are_interpolated() -> None:
    whole = sweep()
    keep = np.r_[0:20, 25:61]
    filled = covering(Schedule(whole.t[keep], whole.position[keep], whole.rate[keep]), 2, 0.1, 5.0)
    np.testing.assert_allclose(filled.t[:61], whole.t, atol=1e-12)
    np.testing.assert_allclose(filled.position[:61], whole.position, atol=3e-3)
    assert np.abs(np.diff(filled.position[:61, 0])).max() < 0.011  # no jump at the end of the gap


def test_ends_are_held_at_rest() -> None:
    late = replace(sweep(), t=sweep().t + 0.55)
    filled = covering(late, 2, 0.1, 10.0)
    assert filled.t[0] <= 0.0
    assert filled.t[-1] > 10.0
    before, after = filled.t < 0.55, filled.t > 6.6
    np.testing.assert_array_equal(filled.position[before], np.tile(late.position[0], (before.sum(), 1)))
    np.testing.assert_array_equal(filled.rate[before | after], 0.0)


def test_a_missing_value_is_interpolated() -> None:
    holed = sweep()
    holed.position[30, 0] = np.nan
    filled = covering(holed, 2, 0.1, 5.0)
    assert filled.position[30, 0] == pytest.approx(0.5 * (holed.position[29, 0] + holed.position[31, 0]))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"t": np.zeros(61)}, "not increasing"),
        ({"position": np.zeros((61, 3))}, "shape"),
        ({"field": np.full((61, 2), np.nan)}, "no number"),
    ],
)
def test_what_cannot_drive_a_plant_is_refused(change: dict[str, np.ndarray], message: str) -> None:
    with pytest.raises(SimulationError, match=message):
        covering(replace(sweep(), **change), 2, 0.1, 5.0)


def test_recorded_field_and_encoder_repeat_the_closed_loop() -> None:
    """Three ways of driving: what the loop did, recorded, gives the same motion without the loop."""
    of = two_axis(loop="closed")
    own = streams(of, NOMINAL, sweep(), **SETTINGS)
    recorded = Schedule(sweep().t[:60], sweep().position[:60], sweep().rate[:60])
    by_field = streams(two_axis(), NOMINAL, replace(recorded, field=own["field"]), **SETTINGS)
    by_encoder = streams(of, NOMINAL, replace(recorded, encoder=own["angle"]), **SETTINGS)
    opened = streams(two_axis(), NOMINAL, sweep(), **SETTINGS)
    same = slice(0, 580)
    np.testing.assert_allclose(by_field["wrench"][same], own["wrench"][same], atol=1e-6)
    np.testing.assert_allclose(by_encoder["wrench"][same], own["wrench"][same], atol=1e-6)
    np.testing.assert_allclose(by_encoder["field"][:58], own["field"][:58], atol=1e-9)
    assert np.abs(opened["field"] - own["field"]).max() > 1e-3  # the loop did something


def test_closed_loop_follows_its_equation() -> None:
    of = two_axis(loop="closed", Kp=0.05, Ki=0.02, latency=2)
    run = streams(of, NOMINAL, sweep(), **SETTINGS)
    desired = sweep()
    expected, total = [100.0 * desired.position[0]], np.zeros(2)
    for k in range(59):
        error = desired.position[k] - run["angle"][max(0, k - 2)]
        total += error
        change = desired.rate[k] * 0.1 + 0.05 * error + 0.02 * 0.1 * total
        expected.append(expected[-1] + 100.0 * change)
    np.testing.assert_allclose(run["field"], expected, atol=1e-9)
