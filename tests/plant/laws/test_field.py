"""What becomes of a field on its way to the motor, against schedules that have it already."""

from __future__ import annotations

import inspect

import numpy as np
import pytest

from kbs_process.plant.attach import attach
from kbs_process.plant.laws import select
from kbs_process.plant.laws.friction import stiction as tooth_stiction
from kbs_process.plant.laws.motor import cogging
from kbs_process.plant.predict import predict, tap_columns
from kbs_process.plant.schedule import Schedule
from kbs_process.rig.model import Rig, substitute
from kbs_process.signals.records import Array
from plant.plant_rigs import two_axis

pytestmark = pytest.mark.slow

EFFECTS = ("synchronous_motor", "motor_viscous", "flexspline")  # what a field acts through: fewer to compile
SECONDS, CYCLE, LATE, SCALE = 8.0, 0.05, 5e-3, 2e-3
START, REACH = np.array([0.4, -0.3]), np.array([0.12, 0.08])
OMEGA = 2.0 * np.pi / 8.0  # from rest to rest


def way(t: Array) -> Array:
    whole: Array = START + np.outer(1.0 - np.cos(OMEGA * np.clip(t, 0.0, None)), 0.5 * REACH)
    return whole


def schedule(position: Array, t: Array) -> Schedule:
    return Schedule(t, position, np.gradient(position, t, axis=0))


def shown(rig: Rig, effects: list[str], driven: Schedule) -> tuple[Array, Array]:
    """Angles, and the fields that the effects see."""
    streams: dict[str, list[Array]] = {"wrench": [], "angle": [], "field": [], "state": []}
    for key, block in predict(
        rig,
        effects,
        driven,
        rate_Hz=100.0,
        angle_rate_Hz=100.0,
        duration_s=SECONDS,
        step_s=1e-3,
        quantise=False,
        taps=True,
    ):
        streams[key].append(block.values)
    columns = [k for k, name in enumerate(tap_columns(rig)) if name.startswith("field.")]
    return np.concatenate(streams["angle"]), np.concatenate(streams["state"])[:, columns]


@pytest.mark.parametrize(
    ("name", "number"), [("controller_latency", "field_latency"), ("controller_gain", "field_gain")]
)
def test_a_changed_field_is_that_of_a_schedule_that_was_changed(name: str, number: str) -> None:
    t = np.arange(-1.0, SECONDS + 0.2, CYCLE)
    rig = two_axis(loop="open")
    changed = {"controller_latency": way(t - LATE), "controller_gain": way(t) + SCALE * (way(t) - START)}[name]
    changed[:, 0] = way(t)[:, 0]  # of the second joint alone
    (effect,) = select([name])
    value = LATE if name == "controller_latency" else SCALE
    with_effect = attach(rig, effect, {number: value}, joints=[rig.joint_names[1]])
    plain = shown(rig, list(EFFECTS), schedule(way(t), t))
    expected = shown(rig, list(EFFECTS), schedule(changed, t))
    found = shown(with_effect, [*EFFECTS, name], schedule(way(t), t))
    microstep = 2.0 * np.pi / 12800.0
    for motor, (bare, right, got) in zip((0.01, 1.0), zip(plain, expected, found, strict=True), strict=True):
        moved = right - bare
        assert np.abs(moved[:, 1]).max() > 20.0 * microstep * motor
        # What is left: a cycle's linear motion against the true way's bend, and a rounding of microsteps.
        np.testing.assert_allclose(got, right, atol=0.02 * np.abs(moved).max() + 1.01 * microstep * motor)
        np.testing.assert_allclose(got[:, 0], right[:, 0], atol=1e-6)


def test_a_recorded_field_has_gain_and_set_points_in_it_already() -> None:
    t = np.arange(-1.0, SECONDS + 0.2, CYCLE)
    rig = two_axis(loop="open")
    ratios = np.array([float(joint.drive.ratio) for joint in rig.joints if joint.drive is not None])
    recorded = Schedule(t, way(t), np.gradient(way(t), t, axis=0), way(t) * ratios)
    gain, lag, late = select(["controller_gain", "controller_lag", "controller_latency"])
    plain, _ = shown(rig, list(EFFECTS), recorded)
    gained, _ = shown(attach(rig, gain, {"field_gain": SCALE}), [*EFFECTS, gain.name], recorded)
    set_late, _ = shown(attach(rig, lag, {"set_point_lag": LATE}), [*EFFECTS, lag.name], recorded)
    lagging, _ = shown(attach(rig, late, {"field_latency": LATE}), [*EFFECTS, late.name], recorded)
    np.testing.assert_array_equal(gained, plain)
    np.testing.assert_array_equal(set_late, plain)
    assert np.abs(lagging - plain).max() > 1e-4  # the driver comes after the record


def test_cycles_that_are_late_in_turn_are_those_of_a_schedule_that_is() -> None:
    t = np.arange(-1.0, SECONDS + 0.2, CYCLE)
    rig = two_axis(loop="open")
    ratio = np.array([float(joint.drive.ratio) for joint in rig.joints if joint.drive is not None])
    (effect,) = select(["controller_jitter"])
    numbers = {"jitter_sin": 4e-3, "jitter_cos": 3e-3, "jitter_frequency": 1.3}
    with_effect = attach(rig, effect, numbers, joints=[rig.joint_names[1]])
    _, field = shown(with_effect, [*EFFECTS, effect.name], schedule(way(t), t))
    samples = np.arange(len(field)) / 100.0
    late = 4e-3 * np.sin(2.0 * np.pi * 1.3 * samples) + 3e-3 * np.cos(2.0 * np.pi * 1.3 * samples)
    microstep = 2.0 * np.pi / 12800.0
    expected = np.interp(samples - late, t, way(t)[:, 1]) * ratio[1]
    plain = np.interp(samples, t, way(t)[:, 1]) * ratio[1]
    assert np.abs(expected - plain).max() > 20.0 * microstep
    np.testing.assert_allclose(field[:, 1], expected, atol=0.05 * np.abs(expected - plain).max() + 0.51 * microstep)


@pytest.mark.parametrize("late", [0.18, 0.03])
def test_a_field_that_is_late_by_cycles_is_the_field_of_then(late: float) -> None:
    """Exactly, through corners where the rate changes: no jump of the field where a cycle ends."""
    t = np.arange(-1.0, SECONDS + 0.5, CYCLE)
    rig = two_axis(loop="open")
    ratio = np.array([float(joint.drive.ratio) for joint in rig.joints if joint.drive is not None])
    (effect,) = select(["controller_latency"])
    with_effect = attach(rig, effect, {"field_latency": late}, joints=[rig.joint_names[1]])
    _, field = shown(with_effect, [*EFFECTS, effect.name], schedule(way(t), t))
    samples = np.arange(len(field)) / 100.0
    microstep = 2.0 * np.pi / 12800.0
    for joint, when in ((0, samples), (1, samples - late)):
        expected = np.interp(when, t, way(t)[:, joint]) * ratio[joint]
        np.testing.assert_allclose(field[:, joint], expected, atol=0.51 * microstep)


@pytest.mark.parametrize("late", [0.18, 0.03])
def test_set_points_that_are_late_are_those_of_then_and_the_field_goes_straight_between(late: float) -> None:
    """As exactly as microsteps are rounded; corners stay where cycles begin."""
    t = np.arange(-1.0, SECONDS + 0.5, CYCLE)
    rig = two_axis(loop="open")
    ratio = np.array([float(joint.drive.ratio) for joint in rig.joints if joint.drive is not None])
    (effect,) = select(["controller_lag"])
    with_effect = attach(rig, effect, {"set_point_lag": late}, joints=[rig.joint_names[1]])
    _, field = shown(with_effect, [*EFFECTS, effect.name], schedule(way(t), t))
    samples = np.arange(len(field)) / 100.0
    microstep = 2.0 * np.pi / 12800.0
    then = np.interp(t - late, t, way(t)[:, 1])
    for joint, set_points in ((0, way(t)[:, 0]), (1, then)):
        expected = np.interp(samples, t, set_points) * ratio[joint]
        np.testing.assert_allclose(field[:, joint], expected, atol=0.51 * microstep)


def test_set_points_that_are_late_by_a_part_of_a_cycle_are_means_of_two() -> None:
    t = np.arange(-1.0, SECONDS + 0.5, CYCLE)
    rig, part = two_axis(loop="open"), 0.3
    smoothed = way(t)
    smoothed[1:, 1] = (1.0 - part) * way(t)[1:, 1] + part * way(t)[:-1, 1]
    (effect,) = select(["controller_lag"])
    with_effect = attach(rig, effect, {"set_point_lag": part * CYCLE}, joints=[rig.joint_names[1]])
    expected, _ = shown(rig, list(EFFECTS), schedule(smoothed, t))
    found, _ = shown(with_effect, [*EFFECTS, effect.name], schedule(way(t), t))
    np.testing.assert_allclose(found, expected, atol=1e-9)


@pytest.mark.parametrize("steps", [400.0, 12800.0])
@pytest.mark.parametrize("recorded", [False, True])
def test_the_field_is_in_whole_microsteps_of_the_drive_s_own(steps: float, recorded: bool) -> None:
    """Of 2 pi / steps_per_turn, whatever Kangle; a recorded field too."""
    t = np.arange(-1.0, SECONDS + 0.2, CYCLE)
    rig = two_axis(loop="open")
    names = {f"joint.{joint.name}.drive.steps_per_turn": steps for joint in rig.joints}
    kangle = {f"joint.{joint.name}.drive.parameters.Kangle": 50.0 for joint in rig.joints}
    ratios = np.array([float(joint.drive.ratio) for joint in rig.joints if joint.drive is not None])
    driven = schedule(way(t), t)
    if recorded:
        driven = Schedule(driven.t, driven.position, driven.rate, driven.position * ratios)
    _, field = shown(substitute(rig, names | kangle), list(EFFECTS), driven)
    codes = field * steps / (2.0 * np.pi)
    np.testing.assert_allclose(codes, np.round(codes), atol=1e-6)
    assert len(np.unique(np.round(codes[:, 0]))) > 20
    expected = np.stack([np.interp(np.arange(len(field)) / 100.0, t, column) for column in (way(t) * ratios).T], axis=1)
    np.testing.assert_allclose(field, expected, atol=0.501 * 2.0 * np.pi / steps)


def test_full_steps_of_cogging_and_tooth_contact_are_no_number_of_the_drive() -> None:
    """They stay 200 a turn: nothing that is configured enters (docs/equations.md)."""
    angle = np.linspace(-4.0, 4.0, 401)
    for name in ("cogging", "tooth_stiction"):
        (effect,) = select([name])
        given = set(inspect.signature(effect.equation).parameters)
        assert not given & {"steps_per_turn", "Kangle"}
    values = np.array([cogging.torque(one, 6e-3, 0.3) for one in angle])
    later = np.array([cogging.torque(one + 2.0 * np.pi / 200.0, 6e-3, 0.3) for one in angle])
    np.testing.assert_allclose(later, values, atol=1e-12)
    contact = np.array([tooth_stiction.limit(one, 0.0, 6e-3, 0.5, 0.3) for one in angle])
    after = np.array([tooth_stiction.limit(one + 2.0 * np.pi / 200.0, 0.0, 6e-3, 0.5, 0.3) for one in angle])
    np.testing.assert_array_equal(after, contact)
