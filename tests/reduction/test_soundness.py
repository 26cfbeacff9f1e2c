"""What was fitted against what was known: sound rigs are called sound, and a simple fault is named."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import archived
from kbs_process.campaign.config import Campaign
from kbs_process.campaign.load import load_campaign
from kbs_process.progress import SilentProgress
from kbs_process.reduction.preparing import fit_gravity
from kbs_process.reduction.settings import motion_settings
from kbs_process.reduction.soundness.checking import _moved_alone, check_model, extent
from kbs_process.reduction.soundness.streams import mistimed, repeated
from kbs_process.rig.model import Quantity, Spacecraft
from kbs_process.signals.records import WRENCH_CHANNELS, Block, Events, Signal
from kbs_process.stages import motion
from kbs_process.stages.align.readings import Readings
from kbs_process.stages.align.spectrum import Welch
from reduction.arm import checked, described, drawn, recorded

UNIT = np.eye(6)
LBF = np.diag([1 / 4.4482216] * 3 + [1.0] * 3)
FAULTS = {
    "gain: all channels of the wrench read 0.5": {"reads": 0.55 * UNIT},
    "sign: all channels of the wrench negated": {"reads": -UNIT},
    "gain: all channels of the wrench read 1.": {"reads": 1.2 * UNIT},
    "unit: all forces in pound-force, taken for N": {"reads": LBF},
    "unit: all torques in N mm, taken for N m": {"reads": np.diag([1.0] * 3 + [1e3] * 3)},
    "sign: Fz negated": {"reads": np.diag([1.0, 1.0, -1.0, 1.0, 1.0, 1.0])},
    "swapped: Fx and Fz": {"reads": UNIT[[2, 1, 0, 3, 4, 5]]},
    "swapped: Tx and Ty": {"reads": UNIT[[0, 1, 2, 4, 3, 5]]},
    "swapped: x and y, of forces and torques": {"reads": UNIT[[1, 0, 2, 4, 3, 5]]},
    "unit: angles of arm": {"angle": np.degrees(1.0)},
    "zero: the angle of arm": {"zero": 0.3},
}


def told(name: str, folder: Path) -> None:
    campaign = described(folder)
    found = checked(campaign, recorded(campaign, drawn(campaign, 1), 1, **FAULTS[name]))
    notice, *_ = found.notices()
    assert (notice.severity, found.soundness.calibrated) == ("error", False)
    assert any(one.startswith(name) for one in found.soundness.suggestions), found.soundness
    cause, _, symptoms = notice.what.removeprefix("the model of this rig is wrong: ").partition(". This explains it: ")
    assert cause == "; or ".join(found.soundness.suggestions) and symptoms == "; ".join(found.soundness.reasons)


@pytest.mark.slow
@pytest.mark.parametrize("name", list(FAULTS)[:2])
def test_a_simple_fault_is_told_and_named(name, tmp_path):
    told(name, tmp_path)


@pytest.mark.validation
@pytest.mark.parametrize("name", list(FAULTS)[2:])
def test_other_faults_are_told_and_named(name, tmp_path):
    told(name, tmp_path)


def test_a_channel_that_repeats_another_is_told(tmp_path):
    campaign = described(tmp_path)
    doubled = UNIT.copy()
    doubled[0] = UNIT[2]
    recordings = recorded(campaign, drawn(campaign, 1), 1, reads=doubled)
    assert "Fz repeats Fx in sweep: one stream is read twice" in list(repeated(recordings))
    assert not list(repeated(recorded(campaign, drawn(campaign, 1), 1)))


def test_an_encoder_that_is_wired_to_two_joints_is_told():
    az = 0.3 * np.sin(np.arange(2000) * 0.01) + 1e-6 * np.random.default_rng(1).standard_normal(2000)
    for el, told in ((az, 1), (0.7 - az, 1), (az + 1e-6 * np.random.default_rng(2).standard_normal(2000), 0)):
        angle = Signal(0.0, 0.05, np.column_stack((az, el)), ("az", "el"), ("rad",) * 2, "joint", np.ones(2000, bool))
        one = SimpleNamespace(entry=SimpleNamespace(name="test"), raw=None, run=SimpleNamespace(angle=angle))
        assert list(repeated([one])) == told * ["el repeats az in test: one stream is read twice"]
        still = replace(angle, values=np.ones((2000, 2)))
        assert not list(repeated([SimpleNamespace(**{**vars(one), "run": SimpleNamespace(angle=still)})]))


@pytest.mark.slow
def test_a_channel_that_died_between_recordings_is_told(tmp_path):
    campaign = described(tmp_path)
    sweep, test = recorded(campaign, drawn(campaign, 1), 1)
    mean = np.append(sweep.raw.values.mean(axis=0)[:5], 0.1)
    zeroed = [one.raw.values - one.raw.values.mean(axis=0) + mean for one in (sweep, test)]
    zeroed[1][:, 5] = 0.002 * np.random.default_rng(1).standard_normal(len(zeroed[1]))
    read = [
        replace(one, raw=one.raw.derive(x, "zeroed"), run=replace(one.run, wrench=one.raw.derive(x, "zeroed")))
        for one, x in zip((sweep, test), zeroed, strict=True)
    ]
    found = checked(campaign, read).soundness
    assert any("Tz does not respond" in one and "test" in one for one in found.reasons), found.reasons
    assert not any("sweep" in one for one in found.reasons)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("which", "column", "told"),
    [
        ((0, 1), None, "channel: Ty does not respond"),
        ((1,), None, "channel: Ty does not respond in test"),
        ((0, 1), 0, "mapping: one column is read for two channels"),
    ],
)
def test_what_a_channel_reads_that_is_dead_or_read_twice_is_no_load(tmp_path, which, column, told):
    campaign = described(tmp_path)
    (judged,) = campaign.requirements
    recordings = recorded(campaign, drawn(campaign, 1), 1)
    for place in which:
        one, values = recordings[place], recordings[place].raw.values.copy()
        noise = 0.002 * np.random.default_rng(place).standard_normal(len(values))
        values[:, 4] = noise if column is None else values[:, column]
        read = one.raw.derive(values, "read")
        recordings[place] = replace(one, raw=read, run=replace(one.run, wrench=read))
    found = checked(campaign, recordings)
    assert "; ".join(found.soundness.suggestions) == told
    assert found.doubts(judged)[0].of_failed


@pytest.mark.slow
@pytest.mark.parametrize("gain", [0.6, 1.5])
def test_a_gain_of_one_recording_is_told_and_nothing_is_judged_by_it(tmp_path, gain):
    campaign = described(tmp_path)
    sweep, test = recorded(campaign, drawn(campaign, 1), 1)
    read = test.raw.derive(test.raw.values * np.array([1.0, 1.0, 1.0, 1.0, gain, 1.0]), "read")
    found = checked(campaign, [sweep, replace(test, raw=read, run=replace(test.run, wrench=read))])
    (told,) = found.soundness.suggestions
    assert told.startswith("gain: Ty read ") and " of what acts in test, unless a load" in told
    assert float(told.split()[3]) == pytest.approx(gain, rel=0.02)
    assert found.doubts(campaign.requirements[0])[0].of_failed, "what is read beyond the limit was not there"


def vague(folder, mass="1.0"):
    """An arm of which only the joint's axis is known well, as `init` writes it."""
    campaign = described(folder)
    text = (folder / "rig.toml").read_text()
    for name, sigma in (("mass", mass), ("cog", "0.3"), ("inertia", "0.3")):
        text = re.sub(rf"(?m)^({name} = .*sigma = )[^,]*", rf"\g<1>{sigma}", text)
    (folder / "rig.toml").write_text(text)
    return load_campaign(folder, checksums=False), drawn(campaign, 1)


@pytest.mark.slow
@pytest.mark.parametrize(("gain", "mass", "told"), [(0.6, "1.0", True), (0.6, "0.01", True), (1.0, "1.0", False)])
def test_inertia_forces_show_a_gain_that_vague_files_hide(tmp_path, gain, mass, told):
    """A gain of Ty alone moves the centre of gravity, and the forces of motion do not follow."""
    campaign, arm = vague(tmp_path, mass)
    reads = np.diag([1.0, 1.0, 1.0, 1.0, gain, 1.0])
    found = checked(campaign, recorded(campaign, arm, 1, reads=reads, period=8.0))
    assert found.soundness.sound is not told, found.soundness.reasons
    assert any(one.startswith("gain: Ty read 0.6") for one in found.soundness.suggestions) is told
    assert any("the gain of Ty by the other channels is 0.6" in one for one in found.soundness.reasons) is told


@pytest.mark.slow
def test_forces_of_motion_show_which_way_a_joint_turns_that_vague_files_hide(tmp_path):
    campaign, arm = vague(tmp_path)
    found = checked(campaign, recorded(campaign, arm, 1, angle=-1.0, period=8.0)).soundness
    assert any(one.endswith("times as likely if arm turns the other way") for one in found.reasons), found.reasons
    assert any(one.startswith("sign: the angle of arm") for one in found.suggestions)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ({"zero": -0.1}, "the zero of arm's angle (degrees) is -5."),
        ({"angle": -1.0}, "the sign of arm's angle is reversed in test"),
        ({"reads": np.diag([1.0, 1.0, 1.0, 1.0, 0.0, 1.0])}, "channel: Ty does not respond in test"),
        ({}, None),
    ],
)
def test_what_is_misread_in_one_recording_alone_is_named(tmp_path, fault, told):
    """Files too vague to test anything: what the calibration has shown of the arm tells what is off in the test."""
    campaign, arm = vague(tmp_path)
    sweep, _ = recorded(campaign, arm, 1)
    _, test = recorded(campaign, arm, 1, **fault)
    found = checked(campaign, [sweep, test])
    doubts = found.doubts(campaign.requirements[0])
    if told is None:
        assert found.soundness.sound and not doubts, found.soundness.reasons
    else:
        (cause,) = found.soundness.suggestions
        assert cause.startswith(told) and doubts[0].of_failed, found.soundness


@pytest.mark.slow
def test_gravity_in_another_unit_is_named(tmp_path):
    campaign = described(tmp_path)
    arm = drawn(campaign, 1)
    text = (tmp_path / "rig.toml").read_text()
    (tmp_path / "rig.toml").write_text(
        text.replace('value = 9.80665, unit = "m/s^2"', 'value = 980.665, unit = "mm/s^2"')
    )
    found = checked(campaign := load_campaign(tmp_path, checksums=False), recorded(campaign, arm, 1)).soundness
    assert found.suggestions[0] == "unit: gravity.magnitude is 0.981 m/s^2, which is nowhere on Earth"


@pytest.mark.slow
def test_a_noise_that_nobody_states_is_no_load(tmp_path):
    campaign, arm = vague(tmp_path)
    text = (tmp_path / "rig.toml").read_text()
    (tmp_path / "rig.toml").write_text(re.sub(r"(?m)^(noise = .*value = )[^,]*.*\], unit", r"\g<1>0.0, unit", text))
    campaign = load_campaign(tmp_path, checksums=False)
    recordings = []
    for one in recorded(campaign, arm, 1):
        stamp = np.arange(len(one.raw)) * round(1e9 * one.raw.dt)
        readings, welch = Readings(), Welch(1.0 / one.raw.dt, 0.1, 100.0, WRENCH_CHANNELS)
        readings.push(Block(stamp, stamp, one.raw.values))
        welch.push(one.raw.values, None)
        run = replace(one.run, spectrum=welch.result(), rates={"wrench": 1.0 / one.raw.dt})
        recordings.append(replace(one, run=run, readings={"wrench": readings}))
    assert checked(campaign, recordings).soundness.reasons == ()


@pytest.mark.slow
def test_a_spacecraft_s_centre_of_mass_within_the_article_is_not_judged_about(tmp_path):
    campaign, doubts = described(tmp_path), {}
    recordings = recorded(campaign, drawn(campaign, 1), 1)
    model = fit_gravity(campaign, recordings, SilentProgress())
    for arm in (1.8e-3, 1.8):
        position = Quantity("spacecraft.position", np.array([0.0, 0.0, -arm]), "m", np.zeros(3), "drawing")
        attitude = Quantity("spacecraft.attitude", np.zeros(3), "rad", np.zeros(3), "drawing")
        judged = replace(campaign.requirements[0], frame="S")
        there = replace(campaign.rig, spacecraft=Spacecraft(position, attitude))
        of = replace(campaign, rig=there, requirements=(judged,))
        found = check_model(of, recordings, model, SilentProgress()).doubts(judged)
        doubts[arm] = [one.why for one in found]
    assert doubts == {
        1.8e-3: ["spacecraft.position is 0.0018 m from the transducer, within the article: look at its unit"],
        1.8: [],
    }


@pytest.mark.slow
def test_an_encoder_that_stops_on_the_way_is_told_in_each_recording(tmp_path):
    campaign = described(tmp_path)
    names = ("sweep", "test", "again")
    campaign = replace(
        campaign, recordings=tuple(replace(campaign.recordings[min(k, 1)], name=name) for k, name in enumerate(names))
    )
    recordings = recorded(campaign, drawn(campaign, 1), 1)
    for place in (1, 2):
        one = recordings[place]
        angle = one.run.angle.values.copy()
        stop = int(50.0 / one.run.angle.dt)
        angle[stop:] = angle[stop]
        run = replace(one.run, angle=one.run.angle.derive(angle, "stopped"))
        recordings[place] = replace(one, run=run, motion=motion.estimate(run, campaign.rig, motion_settings(campaign)))
    found = checked(campaign, recordings).soundness
    stopped = [one for one in found.reasons if one.startswith("the angle of arm is still in")]
    assert [one.split()[7] for one in stopped] == ["test", "again"] and "from 5" in stopped[0], found.reasons
    assert found.suggestions[0].startswith("encoder: it is not read")


@pytest.mark.slow
def test_a_pull_that_goes_its_own_way_is_judged(tmp_path):
    campaign = described(tmp_path)
    sweep, test = recorded(campaign, drawn(campaign, 1), 1)
    pulled = test.raw.values.copy()
    pulled[:, 4] += 2.0 * np.sin(0.7 * np.arange(len(pulled)) * test.raw.dt)
    read = test.raw.derive(pulled, "read")
    found = checked(campaign, [sweep, replace(test, raw=read, run=replace(test.run, wrench=read))])
    assert not any(doubt.of_failed for doubt in found.doubts(campaign.requirements[0]))


@pytest.mark.slow
def test_a_wrench_that_comes_later_than_known_is_told(tmp_path):
    campaign = described(tmp_path)
    sweep, test = recorded(campaign, drawn(campaign, 1), 1)
    wrench = test.run.wrench
    assert wrench is not None
    late = wrench.derive(np.concatenate([wrench.values[:20], wrench.values[:-20]]), "a second late")
    found = checked(campaign, [sweep, replace(test, raw=late, run=replace(test.run, wrench=late))]).soundness
    (beyond,) = (one for one in found.beyond if "lag (s) behind the angles in test" in one.name)
    assert beyond.value == pytest.approx(1.0, rel=0.1)
    assert not any("behind the angles in sweep" in one.name for one in found.beyond)


@pytest.mark.slow
def test_a_lag_that_clocks_do_not_tell_is_shown_by_gravity(tmp_path):
    campaign = described(tmp_path)
    sweep, test = recorded(campaign, drawn(campaign, 1), 1)
    t, wrench = test.raw.t, test.raw.values
    late = test.raw.derive(np.column_stack([np.interp(t - 0.01, t, x) for x in wrench.T]), "10 ms late")
    found = checked(campaign, [sweep, replace(test, raw=late, run=replace(test.run, wrench=late))])
    assert found.soundness.sound
    assert found.late == {"test": pytest.approx(0.01, rel=0.1)}


@pytest.mark.slow
@pytest.mark.parametrize("samples", [6, 20])
def test_a_wrench_that_comes_later_in_all_recordings_is_told(samples, tmp_path):
    campaign = described(tmp_path)
    (judged,) = campaign.requirements
    read = []
    for one in recorded(campaign, drawn(campaign, 1), 1):
        x = one.raw.values
        late = one.raw.derive(np.concatenate([x[:samples], x[:-samples]]), "late")
        read.append(replace(one, raw=late, run=replace(one.run, wrench=late)))
    found = checked(campaign, read)
    lags = {one.name: one.value for one in found.soundness.beyond if "lag (s) behind the angles" in one.name}
    assert len(lags) == 2 and list(lags.values()) == pytest.approx([samples / 20.0] * 2, rel=0.15)
    (suggestion,) = found.soundness.suggestions
    assert suggestion.startswith("clock: the wrench is +") and " s late" in suggestion
    assert found.doubts(judged)[0].of_failed, "what is late leaves gravity in the figures"


@pytest.mark.parametrize(("size", "moved"), [(0.01, False), (5.0, True)])
def test_a_zero_has_moved_by_more_than_noise_or_not_at_all(size, moved):
    rig = SimpleNamespace(loads=SimpleNamespace(noise=np.full(6, 0.02)))
    equation = SimpleNamespace(bias_sigma=np.full(6, 20.0), index=list(range(6)), elements=SimpleNamespace(rig=rig))
    zeros = np.full((2, 6), [[0.0], [1e-4]])
    zeros[1, 1] = size
    assert _moved_alone(equation, zeros)[:, 1].tolist() == [moved, moved]


@pytest.mark.slow
@pytest.mark.parametrize(("axis", "sound"), [("[0, -1, 0]", True), ("[1, 0, 0]", False)])
def test_vague_files_hide_no_wrong_axis(tmp_path, axis, sound):
    """What `init` leaves wide: no slope can be tested, and a calibration has to be gravity's all the same."""
    campaign = described(tmp_path)
    recordings = recorded(campaign, drawn(campaign, 1), 1)
    rig = tmp_path / "rig.toml"
    text = rig.read_text().replace("axis = [0, -1, 0]", f"axis = {axis}")
    for known, vague in (
        ("sigma = [1, 1, 1, 0.1, 0.1, 0.1]", "sigma = 20.0"),
        ('sigma = 0.1, source = "scales"', 'sigma = 2.0, source = "felt"'),
        ("sigma = 0.003", "sigma = 0.3"),
        ("sigma = 0.002", "sigma = 0.3"),
        ("sigma = 0.0005", "sigma = 0.3"),
        ('unit = "mrad", sigma = 0.5', 'unit = "mrad", sigma = 5.0'),
    ):
        assert known in text
        text = text.replace(known, vague)
    rig.write_text(text)
    vague_campaign = load_campaign(tmp_path, checksums=False)
    found = checked(vague_campaign, recordings)
    assert set(found.unconfirmed) == set(vague_campaign.rig.channels)
    assert found.soundness.sound is sound, found.soundness.reasons
    (judged,) = vague_campaign.requirements
    assert [doubt.of_failed for doubt in found.doubts(judged)] == ([] if sound else [True])


@pytest.mark.slow
def test_a_channel_that_no_recording_shows_to_respond_is_told(tmp_path):
    campaign = described(tmp_path)
    (judged,) = campaign.requirements
    recordings = recorded(campaign, drawn(campaign, 4), 4)
    found = checked(campaign, recordings)
    assert found.mute == ("Tz",) and found.soundness.sound, "an arm that turns about y has no torque about z"
    (notice,) = found.notices()
    assert notice.severity == "info" and "shows a response of Tz, only noise" in notice.what
    assert not found.doubts(judged)


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """A sound campaign, its recordings, and the fit to them."""
    campaign = described(tmp_path_factory.mktemp("arm"))
    read = recorded(campaign, drawn(campaign, 1), 1)
    return campaign, read, fit_gravity(campaign, read, SilentProgress())


@pytest.mark.slow
def test_a_clock_that_runs_too_fast_is_told_and_nothing_is_judged_by_it(fitted):
    campaign, _, model = fitted
    (judged,) = campaign.requirements
    read = []
    for one in recorded(campaign, drawn(campaign, 1), 1, period=12.0):
        dt = one.motion.dt / 2.0
        run = replace(one.run, angle=replace(one.run.angle, dt=dt), wrench=replace(one.run.wrench, dt=dt))
        moved = replace(one.motion, dt=dt, qd=2.0 * one.motion.qd, qdd=4.0 * one.motion.qdd)
        read.append(replace(one, raw=replace(one.raw, dt=dt), run=run, motion=moved))
    found = check_model(campaign, read, model, SilentProgress())
    (suggestion,) = found.soundness.suggestions
    assert float(suggestion.removeprefix("clock: all times are ").split()[0]) == pytest.approx(0.5, rel=0.01)
    assert found.doubts(judged)[0].of_failed, "the calibration is wrong as well"


@pytest.mark.slow
def test_gravity_shows_a_gain_as_well_as_the_weight_and_its_place_are_known(fitted):
    campaign, read, model = fitted
    gains = check_model(campaign, read, model, SilentProgress()).soundness.gains
    assert gains["Fz"] == pytest.approx(0.02, rel=0.2), "a mass of 5 +- 0.1 kg"
    assert 0.015 < gains["Ty"] < 0.05 and gains["Tz"] > 1.0
    read = [replace(one, run=replace(one.run, wrench=_gained(one.run.wrench, 1.03))) for one in read]
    found = check_model(campaign, read, fit_gravity(campaign, read, SilentProgress()), SilentProgress())
    assert found.soundness.sound, "which is within two standard deviations"


@pytest.mark.slow
def test_a_rig_of_which_all_is_exact_shows_its_gains(fitted, tmp_path):
    described(tmp_path / "exact")
    rig = tmp_path / "exact" / "rig.toml"
    rig.write_text(re.sub(r"sigma = (\[.*?\]|[\d.e-]+)", "sigma = 0", rig.read_text()))
    campaign, read = load_campaign(tmp_path / "exact", checksums=False), fitted[1]
    gains = check_model(campaign, read, fit_gravity(campaign, read, SilentProgress()), SilentProgress()).soundness.gains
    assert gains["Fz"] < 0.02 and gains["Tz"] > 1.0


def _gained(wrench, gain):
    return wrench.derive(wrench.values * np.where(np.arange(6) == 4, gain, 1.0), "gained")


@pytest.mark.slow
def test_an_encoder_that_stands_still_while_its_joint_turns_is_told(fitted):
    campaign, (sweep, test), model = fitted
    (judged,) = campaign.requirements
    rest = np.zeros_like(test.motion.q)
    dead = replace(test, motion=replace(test.motion, q=rest, qd=rest, qdd=rest))
    found = check_model(campaign, [sweep, dead], model, SilentProgress())
    assert found.soundness.reasons == ("the angle of arm is still in test, and the load changes as if it turned",)
    assert found.soundness.suggestions == ("encoder: it is not read, or does not turn with its joint",)
    assert found.doubts(judged)[0].of_failed
    held, change = sweep.raw.values[:1], np.sin(np.arange(len(rest)) / 60.0)[:, None]
    for pull in ([20.0, 0.0, 0.0, 0.0, 2.0, 0.0], [0.0, 0.0, 0.0, 0.0, 0.2, 0.0]):  # by a cord; less than a turn makes
        read = dead.raw.derive(held + change * np.array(pull), "at rest")
        still = replace(dead, raw=read, run=replace(test.run, wrench=read))
        found = check_model(campaign, [sweep, still], model, SilentProgress())
        assert not any("is still" in one for one in found.soundness.reasons)


@pytest.mark.slow
def test_no_verdict_stands_on_an_encoder_that_does_not_follow_its_command(tmp_path):
    campaign = described(tmp_path)
    sweep, test = recorded(campaign, drawn(campaign, 1), 1)
    angle = test.run.angle
    assert angle is not None
    t = 0.05 * np.arange(len(angle))
    swing = Events(t, angle.values, angle.channels)
    halved = replace(test.run, angle=angle.derive(0.5 * angle.values, "halved"), command=swing)
    found = checked(campaign, [sweep, replace(test, run=halved)])
    (wrong, *_) = found.doubts(campaign.requirements[0])
    assert wrong.of_failed and any("slope of encoder arm" in one for one in found.soundness.reasons)


def test_a_rig_may_weigh_what_its_files_allow(tmp_path):
    body = described(tmp_path).rig.bodies[0]
    light = replace(body, mass=replace(body.mass, value=np.array(0.7), sigma=np.array(0.3)))
    weight, reach = extent(replace(described(tmp_path).rig, bodies=(light,)))
    assert weight == pytest.approx(9.80665 * (0.7 + 4 * 0.3))
    assert reach == pytest.approx(0.2 + np.linalg.norm([0.12 + 0.012, 0.012, 0.012]))


def share(campaign: Campaign, seeds: range) -> float:
    """Of arms drawn from what is stated of them, the part that is judged."""
    found = [checked(campaign, recorded(campaign, drawn(campaign, seed), seed)).soundness for seed in seeds]
    return float(np.mean([one.sound for one in found]))


@pytest.mark.slow
def test_sound_arms_are_sound(tmp_path):
    assert share(described(tmp_path), range(2)) == 1.0


@pytest.mark.validation
def test_at_least_95_percent_of_sound_arms_are_judged(tmp_path):
    assert share(described(tmp_path), range(100, 160)) >= 0.95


def timed(scale: float, *, rates: float = 1.0, noise: float = 0.0, measured: bool = False) -> list[str]:
    """What is told of EL089's commands, or of angles and measured rates, where all times are `scale` times too long."""
    campaign = archived.campaign("EL089", recordings=False)
    rng = np.random.default_rng(1)
    t = 0.1 * np.arange(2000)
    el, rate = 1.3 + 0.1 * np.sin(0.2 * t), rates * 0.02 * np.cos(0.2 * t) + noise * rng.standard_normal(2000)
    still = np.zeros(2000)
    run = SimpleNamespace(angle=None, rate=None, command=None)
    if measured:
        names, valid, dt = ("az", "el"), np.ones(2000, dtype=bool), 0.1 * scale
        run.angle = Signal(0.0, dt, np.column_stack((still, el)), names, ("rad",) * 2, "joint", valid)
        run.rate = Signal(0.0, dt, np.column_stack((still, rate)), names, ("rad/s",) * 2, "joint", valid)
    else:
        values = np.column_stack((still, el, still, rate))
        run.command = Events(scale * t, values, ("az", "el", "az.rate", "el.rate"))
    return list(mistimed(campaign, [SimpleNamespace(entry=SimpleNamespace(name="test"), run=run)]))


@pytest.mark.parametrize("measured", [False, True])
def test_times_at_another_scale_are_told(measured):
    what = "angle" if measured else "command"
    assert timed(1.0, measured=measured) == timed(1.0, noise=0.02, measured=measured) == []
    for scale, found in ((0.5, "2"), (2.0, "0.5")):
        expected = [f"slope of {what} el against its rate in test is {found}, expected 1"]
        assert timed(scale, measured=measured) == expected
    assert timed(2.0, noise=0.005, measured=measured) != []


def test_the_cycle_tells_the_times_of_commands_without_rates():
    assert timed(1.0, rates=0.0) == []
    assert timed(2.0, rates=0.0) == ["interval of commands over controller.cycle in test is 2, expected 1"]


@pytest.mark.slow
def test_nothing_is_judged_at_times_of_another_scale(tmp_path):
    campaign = described(tmp_path)
    sweep, test = recorded(campaign, drawn(campaign, 1), 1)
    angle = test.run.angle
    assert angle is not None
    slopes = np.gradient(angle.values, 0.05, axis=0)
    half = Events(angle.t, np.column_stack((angle.values, 0.5 * slopes)), ("arm", "arm.rate"))
    found = checked(campaign, [sweep, replace(test, run=replace(test.run, command=half))])
    assert found.soundness.suggestions[0].startswith("clock: the times of all streams")
    assert found.doubts(campaign.requirements[0])[0].of_failed
