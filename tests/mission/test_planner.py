"""The planned day: limits, continuity, what is tracked when, the stop and the zenith."""

from __future__ import annotations

import itertools
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from kbs_process.campaign.mission import boundaries
from kbs_process.errors import MissionError
from kbs_process.mission.geometry import azimuth_elevation, line_of_sight
from kbs_process.mission.model import Mission
from kbs_process.mission.planner import Plan, plan
from mission import reference


@cache
def planned() -> Plan:
    """The reference day."""
    return plan(reference.mission(), reference.day().lead)


def in_limits(made: Plan, mission: Mission) -> None:
    limits = mission.limits
    assert (made.q >= limits.low).all() and (made.q <= limits.high).all()
    rate = np.diff(made.q, axis=0) / mission.cycle
    assert np.abs(rate).max() <= limits.rate * (1.0 + 1e-6)
    assert np.abs(np.diff(rate, axis=0)).max() / mission.cycle <= limits.acceleration * (1.0 + 1e-6)


@pytest.mark.parametrize("hours", [0.0, 5.0, 11.0, -0.75, 1.0])
def test_no_limit_is_broken_whatever_the_passes(hours: float) -> None:
    mission = replace(reference.later(hours), cycle=0.5)
    in_limits(plan(mission), mission)


def test_the_reference_day_is_within_its_limits_and_whole() -> None:
    made, day = planned(), reference.day()
    in_limits(made, day.mission)
    assert made.t[0] == pytest.approx(-day.lead) and made.t[-1] == pytest.approx(day.mission.duration)
    assert made.phases[0].start == 0 and made.phases[-1].end == len(made.t)
    assert all(a.end == b.start for a, b in zip(made.phases[:-1], made.phases[1:], strict=True))


def test_while_tracking_the_antenna_looks_at_the_satellite_in_view() -> None:
    relays = {one.name: one for one in reference.mission().relays}
    for phase in planned().phases:
        span = slice(phase.start, phase.end)
        u, hidden = line_of_sight(reference.mission(), relays[phase.relay], planned().t[span])
        if phase.mode == "tracking":
            assert not hidden.any()
            assert planned().q[span] == pytest.approx(azimuth_elevation(u), abs=1e-12)
            assert planned().offset[span].max() < 1e-12
        else:
            assert planned().offset[span].max() > np.radians(10.0)


def test_the_losses_come_when_the_published_day_has_them() -> None:
    losses = [event.t for event in planned().events if event.kind == "loss"]
    assert losses == pytest.approx([1500.0, 4400.0, 6500.0], abs=60.0)


def test_the_first_two_satellites_set_and_the_third_pass_ends_at_the_stop() -> None:
    lost = [phase.end - 1 for phase in planned().phases if phase.mode == "tracking"][:3]
    azimuth, elevation = np.degrees(planned().q[lost]).T
    assert elevation[:2] == pytest.approx([-25.0, -25.0], abs=1.0)
    assert azimuth[2] == pytest.approx(165.0, abs=0.1) and elevation[2] > 0.0


def test_sections_cover_the_day_without_a_gap() -> None:
    found = boundaries(reference.day(), planned())
    assert [entry.name for entry, _, _ in found] == ["1", "2", "3", "4", "5a", "5b", "6", "7", "8"]
    assert found[0][1] == 0.0 and found[-1][2] == reference.mission().duration == 14600.0
    assert all(a[2] == b[1] and b[2] > b[1] for a, b in itertools.pairwise(found))


@pytest.mark.parametrize(("hours", "yaw"), [(-0.5, 0.0), (-0.75, 60.0)])
def test_a_pass_close_to_the_zenith_is_bridged(hours: float, yaw: float) -> None:
    """DRS59 culminates at 87.0 and 88.6 deg, and azimuth would have to accelerate beyond the limit."""
    turned = np.array([0.0, 0.0, np.radians(yaw)])
    mission = replace(reference.later(hours), relays=reference.mission().relays[:1], attitude=turned, cycle=0.5)
    made = plan(mission)
    in_limits(made, mission)
    (bridge,) = [phase for phase in made.phases if phase.mode == "zenith"]
    away = np.degrees(made.offset[bridge.start : bridge.end])
    assert np.degrees(made.q[bridge.start : bridge.end, 1]).max() > 82.0
    assert 0.1 < away.max() < 6.0
    assert away[0] < 0.05 and away[-1] < 0.05
    assert (bridge.end - bridge.start) * mission.cycle < 240.0


def test_a_hand_over_is_as_fast_as_the_limits_allow() -> None:
    phase = next(phase for phase in planned().phases if phase.mode == "hand-over")
    turned = abs(planned().q[phase.end, 0] - planned().q[phase.start, 0])
    least = 2.0 * np.sqrt(turned / reference.mission().limits.acceleration)  # from rest to rest
    assert (phase.end - phase.start) * reference.mission().cycle == pytest.approx(least, abs=8.0)


def test_a_planned_hand_over_leaves_a_satellite_that_could_be_held() -> None:
    mission = replace(reference.mission(), hand_overs=(1400.0, 4300.0), cycle=0.5)
    made = plan(mission)
    in_limits(made, mission)
    begun = [(phase.relay, made.t[phase.start]) for phase in made.phases if phase.mode == "hand-over"]
    assert begun[:2] == [("DRS44", 1400.0), ("DRS59", 4300.0)]


@pytest.mark.parametrize("begin", [1550.0, 20000.0])
def test_a_hand_over_that_cannot_begin_is_refused(begin: float) -> None:
    """The antenna is on its way from 1500 to 1659 s, and the day ends at 14 600 s."""
    with pytest.raises(MissionError, match="no satellite is tracked then"):
        plan(replace(reference.mission(), hand_overs=(begin,), cycle=0.5))


def test_a_planned_hand_over_waits_for_the_end_of_a_bridge() -> None:
    mission = replace(reference.later(-12.0), cycle=0.5)
    whole = plan(mission).phases
    at = next(index for index, phase in enumerate(whole) if phase.mode == "zenith")
    bridge = whole[at]
    inside = 0.5 * (bridge.start + bridge.end) * mission.cycle
    made = plan(replace(mission, hand_overs=(inside,)))
    in_limits(made, mission)
    assert made.phases[: at + 1] == whole[: at + 1]
    last, slew = made.phases[at + 1 : at + 3]  # it leaves from the track, not from the bridge
    assert (last.relay, last.start, last.end) == ("DRS59", bridge.end, bridge.end + 1)
    assert (slew.relay, slew.start) == ("DRS44", bridge.end + 1)


def test_the_antenna_takes_its_time_to_a_satellite_that_has_yet_to_rise() -> None:

    day = reference.mission()
    mission = replace(day, relays=day.relays[:1], cycle=0.5)  # DRS59 alone: it sets, and rises again
    made = plan(mission)
    waits = [phase for phase in made.phases if phase.mode == "pre-pointing"]
    assert waits
    first = waits[0]
    rate = np.abs(np.diff(made.q[first.start : first.end], axis=0)).max() / mission.cycle
    assert (first.end - first.start) * mission.cycle > 1000.0
    assert np.degrees(rate) < 0.3


def test_a_day_without_any_satellite_is_refused() -> None:
    blind = replace(reference.mission(), grazing_height=30000e3, cycle=1.0)
    with pytest.raises(MissionError, match="no relay satellite can be tracked at the beginning"):
        plan(blind)
