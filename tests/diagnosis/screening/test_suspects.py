"""Which suspects a rig has, and that their signatures are what the non-linear plant shows of a little of each."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import archived
from kbs_process.diagnosis.experiments.hypothesis import Tapped
from kbs_process.diagnosis.screening.inlets import Inlet
from kbs_process.diagnosis.screening.ranges import Ranges, ranges_of
from kbs_process.diagnosis.screening.signature import inputs, port_inputs, reduced, sensed
from kbs_process.diagnosis.screening.suspects import Candidate, candidates, half_lengths, point_of
from kbs_process.diagnosis.screening.transfer import follow, respond
from kbs_process.plant.attach import attach
from kbs_process.plant.effect import Effect
from kbs_process.plant.laws import CATALOGUE, SENSING, select
from kbs_process.plant.laws.position.order import JOINT_ORDER
from kbs_process.plant.predict import Schedule, predict, tap_columns
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array
from kbs_process.stages.align.resample import resample

pytestmark = pytest.mark.slow

CHANNELS = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz", "az", "el")
NOMINAL = tuple(effect.name for effect in CATALOGUE[:6])
RATE, DT = 100.0, 0.05
TONES = {"floor_frequency": (2.3,), "mains_frequency": (0.7, 1.1), "jitter_frequency": (1.7,)}


@cache
def rig() -> Rig:
    return archived.rig()


@cache
def tapped() -> Tapped:
    """Both joints turn ahead and back, without any windup."""
    t = np.arange(2000) / RATE
    q = np.stack([0.1 - 0.02 * np.cos(0.6 * t), 1.3 + 0.05 * np.sin(0.3 * t)], axis=1)
    rate = np.gradient(q, t, axis=0)
    plate = np.zeros((len(t), 6))
    return Tapped(RATE, tap_columns(rig()), np.hstack([100.0 * q, 100.0 * q, 100.0 * rate, q, rate, plate]))


@cache
def prediction() -> Array:
    t = np.arange(400) * DT
    wrench = np.stack([(k + 1.0) * np.sin(0.4 * t + k) + 10.0 * k for k in range(6)], axis=1)
    return np.hstack([wrench, tapped().values[::5, 6:8]])


def ranges(**given: bool) -> Ranges:
    return ranges_of([tapped()], [prediction()], CHANNELS, DT, proposed=TONES, **given)


def suspects(of: Rig | None = None, *, accepted: tuple[str, ...] = (), **given: bool) -> tuple[Candidate, ...]:
    found = ranges(temperature=given.pop("temperature", False))
    return candidates(of or rig(), NOMINAL, found, tapped().columns, CHANNELS, accepted=accepted, **given)


def one(name: str, site: str, **shape: float) -> Candidate:
    return next(
        s
        for s in suspects(field_recorded=False)
        if (s.name, s.site) == (name, site) and shape.items() <= dict(s.shape).items()
    )


def test_every_law_that_the_model_leaves_out_is_a_suspect_once_a_site_and_shape() -> None:
    every = suspects(temperature=True, field_recorded=False)
    laws = {effect.name for effect in CATALOGUE} - set(NOMINAL) | {law.name for law in SENSING}
    assert {suspect.name for suspect in every} == laws
    assert len(set(every)) == len(every)
    assert {s.site for s in every if s.name == "harness"} == {"az", "el"}
    assert {s.site for s in every if s.name == "floor_vibration"} == {"floor"}
    assert {s.site for s in every if s.name == "base_hysteresis"} == {"T"}
    assert len({s.site for s in every if s.name == "cross_coupling"}) == 30
    assert len({s.site for s in every if s.name == "channel_interaction"}) == 6 * 21 - 6
    for suspect in every:
        shapes = [entry.name for entry in suspect.effect.parameters if entry.role == "shape"]
        assert [name for name, _ in suspect.shape] == shapes
        assert suspect.amplitudes


def test_what_nobody_recorded_is_no_suspect() -> None:
    names = {suspect.name for suspect in suspects()}
    assert not names & {"controller_gain", "controller_lag", "drift_temperature"}
    assert {s.site for s in suspects() if s.name == "controller_latency"} == {"az", "el"}  # the driver's
    quiet = replace(ranges(), proposed={})
    assert not {"mains", "floor_vibration"} & {
        s.name for s in candidates(rig(), NOMINAL, quiet, tapped().columns, CHANNELS)
    }
    gearless = replace(
        rig(),
        joints=tuple(
            replace(joint, drive=replace(joint.drive, parameters={"Ka": joint.drive.parameters["Ka"]}))
            for joint in rig().joints
            if joint.drive is not None
        ),
    )
    names = {suspect.name for suspect in suspects(gearless)}
    assert "kinematic_error" not in names and "backlash" in names  # fsv is missing, Ka is there


def test_a_plate_that_does_not_turn_has_no_mounting_to_suspect() -> None:
    stiff = replace(rig(), transducer=replace(rig().transducer, stiffness=None, damping=None))
    assert not {"base_hardening", "base_hysteresis"} & {suspect.name for suspect in suspects(stiff)}


def test_a_mounting_is_moved_by_the_plate_about_each_axis_alone() -> None:
    turned = Tapped(RATE, tapped().columns, np.zeros((2000, len(tapped().columns))))
    angle = 1e-3 * np.sin(np.arange(2000) / RATE)
    turned.values[:, turned.columns.index("angle.Ty")] = angle
    columns = inputs(one("base_hardening", "T", base_hardening_power=3.0), turned, rig(), NOMINAL)
    shown = np.stack([[column[Inlet("base_torque", "", a)] for a in "xyz"] for column in columns])
    middle = 0.5 * (angle[1:] + angle[:-1])
    np.testing.assert_allclose(shown[1, 1, :-1], -((middle / 1e-3) ** 3), atol=1e-3)
    shown[1, 1] = 0.0
    assert not shown.any()


def test_places_lie_where_the_joint_has_been() -> None:
    angle = tapped().values[:, tapped().columns.index("joint_angle.el")]
    places = {dict(s.shape)["local_angle"] for s in suspects() if (s.name, s.site) == ("local_torque", "el")}
    assert len(places) == 12
    assert angle.min() < min(places) and max(places) < angle.max()
    assert {dict(s.shape)["mains_frequency"] for s in suspects() if s.name == "mains"} == {0.7, 1.1}


def test_an_accepted_law_may_act_once_more_where_it_acts_already() -> None:
    order = one("motor_order", "el", order=2.0).effect
    assert isinstance(order, Effect)
    acting = attach(rig(), order, {"order_sin": 1e-3, "order": 2.0}, joints=["el"])
    found = {s.site: s for s in suspects(acting, accepted=("motor_order",)) if s.name == "motor_order"}
    assert (found["az"].effect.name, found["el"].effect.name) == ("motor_order", "motor_order_2")
    assert dict(found["el"].shape).keys() == {"order_2"}
    twice = inputs(found["el"], tapped(), acting, NOMINAL)[0][Inlet("motor_torque", "el")]
    once = next(
        s for s in suspects() if s.name == "motor_order" and s.site == "el" and s.shape[0][1] == found["el"].shape[0][1]
    )
    np.testing.assert_array_equal(twice, inputs(once, tapped(), rig(), NOMINAL)[0][Inlet("motor_torque", "el")])
    assert [entry.name for entry in found["el"].amplitudes] == ["order_sin_2", "order_cos_2"]
    pulled = {s.effect.name for s in suspects(accepted=("tether",)) if s.name == "tether"}
    assert pulled == {"tether_2"}  # a force has one place, wherever the next is looked for


def test_what_residuals_propose_is_tried_at_every_action_and_at_its_own_joint() -> None:
    acting = attach(rig(), one("motor_order", "el", order=2.0).effect, {"order_sin": 1e-3, "order": 2.0})  # type: ignore[arg-type]
    lines = replace(ranges(), proposed={"order": (17.5,), "local_angle.el": (1.2345,)})
    every = candidates(acting, NOMINAL, lines, tapped().columns, CHANNELS, accepted=("motor_order",))
    orders = {dict(s.shape)["order_2"] for s in every if (s.effect.name, s.site) == ("motor_order_2", "el")}
    assert 17.5 in orders
    tried = {s.site for s in every if s.name == "local_torque" and dict(s.shape)["local_angle"] == 1.2345}
    assert tried == {"el"}


def test_a_force_on_a_link_is_a_wrench_about_the_transducer() -> None:
    bungee = one("bungee", "el")
    (column,) = inputs(bungee, tapped(), rig(), NOMINAL)
    F = np.stack([column[Inlet("external_wrench", "el", axis)] for axis in ("Fx", "Fy", "Fz")], axis=1)
    M = np.stack([column[Inlet("external_wrench", "el", axis)] for axis in ("Tx", "Ty", "Tz")], axis=1)
    np.testing.assert_allclose(F, port_inputs(bungee, tapped(), rig())[:, 0])
    np.testing.assert_allclose(np.sum(F * M, axis=1), 0.0, atol=1e-9)
    # At azimuth zero what is (x, y, z) in E lies at (x cos q - z sin q, y, x sin q + z cos q) from A.
    (x, y, z), q = point_of(rig(), "el"), 1.3
    height = 0.22 + x * np.sin(q) + z * np.cos(q)
    still = Tapped(RATE, tapped().columns, np.zeros((5, len(tapped().columns))))
    still.values[:, still.columns.index("joint_angle.el")] = q
    (column,) = inputs(bungee, still, rig(), NOMINAL)
    F0 = np.array([column[Inlet("external_wrench", "el", axis)][0] for axis in ("Fx", "Fy", "Fz")])
    lever = np.array([x * np.cos(q) - z * np.sin(q), y, height])
    M0 = np.array([column[Inlet("external_wrench", "el", axis)][0] for axis in ("Tx", "Ty", "Tz")])
    np.testing.assert_allclose(M0, np.cross(lever, F0), atol=1e-9)


def test_an_area_in_the_air_is_looked_for_around_the_link() -> None:
    """Where the homogeneous box of the antenna's mass and inertia has its faces, whichever joint moves them."""
    drags = [s for s in suspects() if (s.name, s.site) == ("air_drag", "el")]
    (antenna,) = (body for body in rig().bodies if body.on == "el")
    reach = half_lengths(rig(), "el")
    mass = float(antenna.mass)
    box = mass / 3.0 * (np.sum(reach**2) - reach**2)  # inertia of a box with such half sides
    np.testing.assert_allclose(box, antenna.inertia.value[:3])
    places = np.array([drag.point for drag in drags]) - antenna.cog.value
    expected = np.vstack([np.zeros(3), *(np.outer([-a, a], np.eye(3)[k]) for k, a in enumerate(reach))])
    np.testing.assert_allclose(places, expected, atol=1e-12)
    assert {s.point for s in suspects() if s.name == "tether" and s.site == "el"} == {tuple(antenna.cog.value)}
    # Azimuth alone: sideways, in proportion to the square of the distance from its axis.
    turned = Tapped(RATE, tapped().columns, np.zeros((2000, len(tapped().columns))))
    turned.values[:, turned.columns.index("joint_angle.az")] = 0.03 * np.arange(2000) / RATE
    for drag in drags:
        assert drag.point is not None
        force = port_inputs(drag, turned, rig())[:, 0]
        speed = 0.03 * np.hypot(*drag.point[:2])
        np.testing.assert_allclose(np.linalg.norm(force, axis=1), (speed / 0.01) ** 2, rtol=1e-6)


def test_a_floor_shakes_in_any_direction_and_may_run_up() -> None:
    t = (np.arange(2000) + 0.5) / RATE
    for sweep in (0.0, 0.05):
        tones = replace(ranges(), proposed=TONES | {"floor_sweep": (sweep,)})
        (shaken,) = (
            s
            for s in candidates(rig(), NOMINAL, tones, tapped().columns, CHANNELS)
            if s.name == "floor_vibration" and dict(s.shape)["floor_sweep"] == sweep
        )
        assert len(shaken.amplitudes) == 6
        columns = inputs(shaken, tapped(), rig(), NOMINAL)
        shown = np.stack([[column[Inlet("base_acceleration", "", a)] for a in "xyz"] for column in columns])
        phase = np.pi * (2.0 * 2.3 + sweep * t) * t
        assert shown.shape == (6, 3, 2000)
        for axis in range(3):
            np.testing.assert_allclose(shown[2 * axis, axis, :-1], np.sin(phase)[:-1], atol=0.01)
            np.testing.assert_allclose(shown[2 * axis + 1, axis, :-1], np.cos(phase)[:-1], atol=0.01)
            assert not np.delete(shown[2 * axis : 2 * axis + 2], axis, axis=1).any()


def test_a_wrong_field_is_followed_by_the_motor() -> None:
    late = one("controller_latency", "el")
    drive = rig().joint("el").drive
    assert drive is not None
    stiffness = float(drive.parameters["Tmax"]) * float(drive.parameters["Kangle"])
    (column,) = inputs(late, tapped(), rig(), NOMINAL)
    np.testing.assert_allclose(
        column[Inlet("motor_torque", "el")], stiffness * port_inputs(late, tapped(), rig())[:, 0, 0], rtol=1e-6
    )


@pytest.mark.parametrize(
    ("name", "site", "touched"),
    [
        ("channel_gain", "Ty", {4}),
        ("cross_coupling", "Tx<-Fz", {3}),
        ("encoder_eccentricity", "el", {7}),
        ("clock_offset", "wrench", set(range(6))),
        ("clock_skew", "encoder", {6, 7}),
    ],
)
def test_a_sensor_changes_its_own_channels(name: str, site: str, touched: set[int]) -> None:
    t = np.arange(len(prediction())) * DT
    change = sensed(one(name, site), t, prediction(), CHANNELS, rig())
    assert set(np.flatnonzero(np.abs(change).max(axis=(0, 2)))) == touched
    if name == "cross_coupling":
        np.testing.assert_array_equal(change[:, 3, 0], prediction()[:, 2])
    if name == "clock_offset":
        away = slice(40, -40)
        np.testing.assert_allclose(change[away, 1, 0], -0.8 * np.cos(0.4 * t + 1.0)[away], atol=2e-3)


def test_vibration_beyond_the_working_band_takes_a_play_to_and_fro() -> None:
    """Vibration of twice the play's width leaves little of the loop that the slow load makes (dither)."""
    play, n = one("channel_hysteresis", "Ty"), len(prediction())
    small = replace(play, shape=(("loop_memory", 0.3),))
    t = np.arange(n * 5) / RATE
    slow = np.zeros((len(t), len(CHANNELS)))
    slow[:, 4] = 5.0 * np.sin(0.4 * t)
    shaken = slow.copy()
    shaken[:, 4] += 1.2 * np.sin(2.0 * np.pi * 30.0 * t)

    def loop(readings: Array) -> float:
        along = Tapped(RATE, tapped().columns, tapped().values, readings)
        change = reduced(small, along, CHANNELS, rig(), DT, n)
        assert change.shape == (n, len(CHANNELS), 1)
        assert set(np.flatnonzero(np.abs(change).max(axis=(0, 2)))) == {4}
        return float(-change[:, 4, 0] @ np.gradient(slow[::5, 4]))

    assert loop(shaken) < 0.5 * loop(slow)
    # At rest beyond the working band it is what it is at the working rate.
    plain = sensed(small, np.arange(n) * DT, slow[::5], CHANNELS, rig())[:, 4, 0]
    at_rate = reduced(small, Tapped(RATE, (), slow, slow), CHANNELS, rig(), DT, n)[:, 4, 0]
    assert np.abs(plain - at_rate)[5:-5].max() < 0.12


def test_spans_of_what_sensors_read_are_those_of_the_whole_band() -> None:
    fast = np.repeat(prediction(), 5, axis=0)
    fast[::2, 4] += 3.0
    found = ranges_of([replace(tapped(), readings=fast)], [prediction()], CHANNELS, DT).spans
    without = ranges().spans
    assert found["Ty", "reading"][1] == pytest.approx(without["Ty", "reading"][1] + 3.0)
    assert found["Tx", "reading"] == without["Tx", "reading"]


def test_a_clock_that_wanders_with_any_period_is_near_one_that_is_tried() -> None:
    law = next(law for law in SENSING if law.name == "clock_wander")
    entry = next(entry for entry in law.parameters if entry.name == "wander_period")
    periods, t = ranges().choices(entry, "encoder", None), np.arange(400) * DT
    for turns in np.linspace(0.75, 13.5, 40):  # over the recording
        tone = np.sin(2.0 * np.pi * turns * t / t[-1] + turns)
        shares = []
        for period in periods:
            pair = np.stack([np.sin(2.0 * np.pi * t / period), np.cos(2.0 * np.pi * t / period)], axis=1)
            left = tone - pair @ np.linalg.lstsq(pair, tone, rcond=None)[0]
            shares.append(1.0 - (left @ left) / (tone @ tone))
        assert max(shares) > 0.7, turns


def test_every_law_has_a_family_and_a_port_in_words() -> None:
    assert {law.name for law in (*CATALOGUE, *SENSING) if not law.family} == {"synchronous_motor", "flexspline"}
    for suspect in suspects(temperature=True, field_recorded=False):
        assert suspect.effect.family and suspect.port.word
    assert one("appendage", "el").effect.port_word == "appendage"


# name, amplitude, value, channels that show it, and how well: correlation of both, and their ratio
SMALL = [
    ("motor_order", "order_sin", 1e-3, ("el",), 0.99),
    ("kinematic_error", "kinematic_sin", 1e-5, ("Ty", "el"), 0.99),
    ("joint_viscous", "joint_viscous", 5.0, ("el",), 0.99),
    ("harness", "harness_spring", 0.3, ("el",), 0.99),
    ("ground_cable", "cable_spring", 0.1, ("Ty", "el"), 0.99),
    ("appendage", "sway_inertia", 0.05, ("Ty",), 0.98),
]


def shown(of: Rig, effects: tuple[str, ...], *, taps: bool = False) -> tuple[Array, Array]:
    """Channels at the working rate, and taps, of 12 s in which the antenna starts, turns by 1.5 deg and stops."""
    t = np.arange(0.0, 12.2, 0.1)
    rate = np.deg2rad(0.3) * np.clip(np.minimum(t - 2.0, 9.0 - t) / 2.0, 0.0, 1.0)
    q = 1.3 + np.concatenate([[0.0], np.cumsum(rate)[:-1]]) * 0.1
    schedule = Schedule(t, np.stack([0.0 * q, q], axis=1), np.stack([0.0 * q, rate], axis=1), None, None)
    streams: dict[str, list[Array]] = {"wrench": [], "angle": [], "field": [], "state": []}
    for key, block in predict(
        of, effects, schedule, rate_Hz=RATE, angle_rate_Hz=RATE, duration_s=12.0, quantise=False, taps=taps
    ):
        streams[key].append(block.values)
    fast = np.hstack([np.concatenate(streams["wrench"]), np.concatenate(streams["angle"])[:1200]])
    return resample(fast, RATE, 20.0), np.concatenate(streams["state"]) if taps else fast


@cache
def without() -> tuple[Rig, tuple[str, ...], Array, Tapped]:
    """One plant with all of them, at no amplitude: its module is compiled once."""
    full, names = rig(), (*NOMINAL, *(name for name, *_ in SMALL))
    for effect in select(names):
        full = attach(full, effect)
    base, state = shown(full, names, taps=True)
    return full, names, base, Tapped(RATE, tap_columns(full), state)


@pytest.mark.parametrize(("name", "amplitude", "value", "channels", "like"), SMALL)
def test_a_little_of_it_in_the_plant_shows_as_its_signature(
    name: str, amplitude: str, value: float, channels: tuple[str, ...], like: float
) -> None:
    full, names, base, along = without()
    found = ranges_of([along], [base], CHANNELS, DT)
    suspect = next(
        s for s in candidates(full, NOMINAL, found, along.columns, CHANNELS) if (s.name, s.site) == (name, "el")
    )
    assert isinstance(suspect.effect, Effect)
    changed, _ = shown(attach(full, suspect.effect, dict(suspect.shape) | {amplitude: value}, joints=["el"]), names)
    index = [entry.name for entry in suspect.amplitudes].index(amplitude)
    column = {inlet: value * series for inlet, series in inputs(suspect, along, full, names)[index].items()}
    taps = dict(zip(along.columns, along.values.T, strict=True))
    path = follow(full, select(NOMINAL), taps, RATE)
    linear = respond(path, [column], CHANNELS[:6], 5, len(base))[:, :, 0]
    inner = slice(10, -10)  # the resampling's edges
    for channel in channels:
        k = CHANNELS.index(channel)
        true, expected = (changed - base)[inner, k], linear[inner, k]
        ratio = np.sqrt(expected @ expected / (true @ true))
        assert true @ expected / np.sqrt((true @ true) * (expected @ expected)) > like, channel
        assert ratio == pytest.approx(1.0, abs=0.1), channel


def test_weight_has_a_moment_about_no_axis_along_gravity() -> None:
    assert {s.site for s in suspects() if s.name == "mass_shift"} == {"el"}
    lying = replace(rig(), joints=tuple(replace(joint, axis=(0.0, 1.0, 0.0)) for joint in rig().joints))
    assert {s.site for s in suspects(lying) if s.name == "mass_shift"} == {"az", "el"}


def test_a_rig_that_its_motion_drives_has_no_field_that_could_be_late() -> None:
    columns = tuple(name for name in tapped().columns if not name.startswith("field."))
    names = {s.name for s in candidates(rig(), NOMINAL, ranges(), columns, CHANNELS)}
    assert "joint_viscous" in names and "controller_latency" not in names


@pytest.mark.parametrize("swept", [0.0, 1e-12])
def test_what_rests_has_no_places_and_no_widths(swept: float) -> None:
    """A channel that shows nothing of any load: a share of nothing would be a width of zero."""
    law = next(one for one in SENSING if one.name == "channel_step")
    shapes = [entry for entry in law.parameters if entry.role == "shape"]
    still = Ranges({("Tx", "reading"): (2.0, 2.0 + swept)})
    assert not still.choices(next(e for e in shapes if e.name == "jump_width"), "Tx", None)
    moved = Ranges({("Tx", "reading"): (2.0, 3.0)})
    for entry in shapes:
        choices = moved.choices(entry, "Tx", None)
        assert len(choices) == len(entry.grid)
        assert all(entry.bounds[0] <= value <= entry.bounds[1] for value in choices)


@pytest.mark.parametrize(("swept", "orders"), [(1.2, (6.0, 200.0, 202.0)), (3.3, (2.0, 3.0, 4.0, 6.0, 200.0, 202.0))])
def test_an_order_that_does_not_come_once_is_none(swept: float, orders: tuple[float, ...]) -> None:
    """In a part of its period it is a curve, as of a spring."""
    entry = next(e for e in JOINT_ORDER.parameters if e.name == "joint_order")
    passed = Ranges({("el", "joint_angle"): (0.3, 0.3 + swept)}, {"joint_order.el": (0.5,)})
    assert passed.choices(entry, "el", None) == orders
    assert passed.choices(entry, "az", None) == ()
