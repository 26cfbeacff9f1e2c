"""A recording that was started late: the prediction is that of the whole run, not of a plant thrown into motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from campaign.campaign_folder import EXAMPLE
from kbs_process.campaign.load import load_campaign
from kbs_process.plant.predict import predict
from kbs_process.plant.schedule import Schedule
from kbs_process.reduction.predicting import LEAD, approached, predict_run
from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS, Events, Run, Signal
from kbs_process.stages.align.condense import CondenseSettings

RATE = np.radians(0.3)
EMPTY = Run("late", None, None, None, None, None, None, None, None, None, 0)


def slew(duration: float = 40.0) -> Schedule:
    """Rest, a ramp of ten seconds, then a constant rate."""
    t = 0.1 * np.arange(round(duration / 0.1))
    ramp = np.clip(t - 2.0, 0.0, 10.0)
    angle = RATE * (ramp**2 / 20.0 + np.clip(t - 12.0, 0.0, None))
    position = np.stack([np.zeros(len(t)), 1.2 + angle], axis=1)
    return Schedule(t, position, np.gradient(position, 0.1, axis=0), field=100.0 * position)


def late(schedule: Schedule, start: float) -> Schedule:
    kept = schedule.t >= start - 1e-9
    return Schedule(schedule.t[kept] - start, *(x[kept] for x in (schedule.position, schedule.rate, schedule.field)))


def test_what_preceded_is_smooth_and_ends_where_the_recording_begins() -> None:
    given = replace(late(slew(), 20.0), encoder=late(slew(), 20.0).position)
    whole = approached(given)
    lead = len(whole.t) - len(given.t)
    assert whole.t[0] == pytest.approx(-2.0 * LEAD)
    for name in ("t", "position", "rate", "field", "encoder"):
        np.testing.assert_array_equal(getattr(whole, name)[lead:], getattr(given, name))
    speed = np.diff(whole.position[:, 1]) / 0.1
    assert abs(speed[0]) < 0.02 * RATE
    assert speed[lead - 50 : lead + 50] == pytest.approx(RATE)
    assert np.abs(np.diff(speed)).max() < 0.011 * RATE
    np.testing.assert_allclose(whole.field, 100.0 * whole.position)
    np.testing.assert_allclose(whole.encoder, whole.position)
    np.testing.assert_allclose(whole.rate[1:lead, 1], speed[: lead - 1], atol=0.011 * RATE)


def test_a_recording_that_begins_at_rest_is_left_alone() -> None:
    given = slew()
    assert approached(given) is given


def test_nothing_is_predicted_for_a_time_without_commands() -> None:
    campaign = load_campaign(EXAMPLE, checksums=False)
    names = campaign.rig.joint_names
    slewed = slew(30.0)
    events = Events(slewed.t + 12.0, slewed.position, names)
    t = np.arange(800) * 0.05
    wrench = Signal(0.0, 0.05, np.zeros((800, 6)), WRENCH_CHANNELS, WRENCH_UNITS, "T", np.ones(len(t), dtype=bool))
    run = replace(EMPTY, wrench=wrench, command=events, rates={"wrench": 100.0, "angle": 20.0})
    predicted = predict_run(campaign.rig, campaign.effects, run, CondenseSettings(working_rate_Hz=20.0))
    for signal in (predicted.wrench, predicted.angle):
        assert signal is not None
        assert not signal.valid[signal.t < 11.8].any()
        assert signal.valid[(signal.t > 12.0) & (signal.t < 35.0)].all()
    punctual = replace(run, command=replace(events, t=slewed.t + 0.05))
    known = predict_run(campaign.rig, campaign.effects, punctual, CondenseSettings(working_rate_Hz=20.0))
    assert known.wrench is not None
    assert known.wrench.valid[20:-20].all()


def test_late_recording_is_predicted_as_the_whole_one() -> None:
    campaign = load_campaign(EXAMPLE, checksums=False)

    def wrench(schedule: Schedule, duration: float) -> np.ndarray:
        settings = {"rate_Hz": 100.0, "angle_rate_Hz": 10.0, "duration_s": duration}
        blocks = predict(campaign.rig, campaign.effects, schedule, **settings)
        return np.concatenate([block.values for key, block in blocks if key == "wrench"])

    whole, cut = wrench(slew(), 40.0)[2500:], late(slew(), 25.0)
    assert np.ptp(wrench(cut, 15.0)[:500, 4] - whole[:500, 4]) > 0.2  # N m, of a slew that makes 0.06
    assert np.ptp(wrench(approached(cut), 15.0)[:, 4] - whole[:, 4]) < 0.02
