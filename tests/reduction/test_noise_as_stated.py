"""The noise of each channel against what is stated of it: what averages or filters a channel takes it off."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import butter, lfilter, sosfilt

import archived
from kbs_process.reduction.soundness.noise import slow_share, unlike_stated
from kbs_process.signals.records import Block
from kbs_process.stages.align.readings import Readings
from kbs_process.stages.align.spectrum import Welch

RATE = 100.0
TY, TZ = 4, 5


def wrench(rig, seed: int = 1, seconds: float = 60.0) -> np.ndarray:
    """Readings (n, 6) as EL089's amplifier gives them: a swing, a vibration at 9 Hz, white noise, steps."""
    t = np.arange(int(seconds * RATE)) / RATE
    moving = np.sin(0.5 * t) * 5.0 + 0.05 * np.sin(2.0 * np.pi * 9.0 * t)
    white = np.random.default_rng(seed).standard_normal((len(t), 6)) * rig.transducer.noise.value
    return moving[:, None] + white


def rounded(rig, values: np.ndarray) -> np.ndarray:
    return np.round(values / rig.transducer.resolution.value) * rig.transducer.resolution.value


def told(change, *, stated: float = 1.0, frame: str = "S") -> list[str]:
    """What is told of EL089's noise where a recording is changed, of `stated` times the noise."""
    campaign = archived.campaign("EL089", recordings=False)
    noise = campaign.rig.transducer.noise
    rig = replace(
        campaign.rig, transducer=replace(campaign.rig.transducer, noise=replace(noise, value=stated * noise.value))
    )
    values = change(campaign.rig, wrench(campaign.rig))
    stamp = (np.arange(len(values)) * 1e9 / RATE).astype(np.int64)
    readings, welch = Readings(), Welch(RATE, 0.1, 100.0, rig.transducer.channels)
    readings.push(Block(stamp, stamp, values))
    welch.push(values, None)
    run = SimpleNamespace(spectrum=welch.result(), rates={"wrench": RATE})
    raw = SimpleNamespace(values=values, dt=1.0 / RATE)
    one = SimpleNamespace(entry=SimpleNamespace(name="test"), raw=raw, run=run, readings={"wrench": readings})
    requirement = replace(campaign.requirements[0], frame=frame)
    return [doubt.why for doubt in unlike_stated(requirement, rig, [one])]


def smoothed(column: int, corner: float):
    """One channel behind a hidden low-pass of first order."""

    def change(rig, values):
        a, found = np.exp(-2.0 * np.pi * corner / RATE), values.copy()
        found[:, column] = lfilter([1.0 - a], [1.0, -a], values[:, column])
        return rounded(rig, found)

    return change


def scaled(column: int, factor: float):
    return lambda rig, values: values * np.where(np.arange(6) == column, factor, 1.0)


def averaged(rig, values):
    """Means of one second that a logger stores."""
    kernel = np.ones(int(RATE)) / RATE
    return np.stack([np.convolve(x, kernel, "valid") for x in values.T], axis=1)


def blow(rig, values):
    """A hammer in Tz, and a reading that was lost."""
    found = values.copy()
    found[3000:3004, TZ] += [5.0, -20.0, 10.0, -5.0]
    found[4000] = 0.0
    return found


@pytest.mark.parametrize("change", [rounded, blow, smoothed(TY, 10.0)])
def test_noise_that_is_as_stated_is_not_told(change):
    assert told(change) == []


def test_a_channel_behind_a_hidden_low_pass_is_told():
    (why,) = told(smoothed(TY, 0.4))
    assert "not as stated in test: Ty has " in why and "not 0.002 +- 0.0005: averaged or filtered" in why
    assert not any(name in why for name in ("Fx", "Fy", "Fz", "Tx", "Tz"))


def test_a_channel_that_is_not_judged_is_not_told():
    assert told(smoothed(0, 0.4), frame="T") == [] != told(smoothed(0, 0.4))


def test_means_that_a_logger_stores_are_told():
    (why,) = told(averaged)
    assert all(f"{name} has " in why for name in ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz"))


@pytest.mark.parametrize(("factor", "remark"), [(0.1, "filtered"), (20.0, "disturbed")])
def test_another_scale_of_a_channel_that_gravity_does_not_load_is_told(factor, remark):
    (why,) = told(scaled(TZ, factor))
    assert "Tz has " in why and remark in why and "another scale" in why


def alternating(size: float):
    """A second source that brings Ty by turns, without what moves it at 0.5 Hz; it moves in half of the time."""

    def change(rig, values):
        t = np.arange(len(values)) / RATE
        found = values.copy()
        found[1::2, TY] += (size * np.sin(np.pi * t) * (t > 30.0))[1::2]
        return rounded(rig, found)

    return change


def still(corner: float, level: float = 0.0):
    """Noise, a level and a tone of 0.1 Hz in Ty alone, behind a high-pass of first order in all channels."""

    def change(rig, values):
        values = (np.random.default_rng(3).standard_normal((20_000, 6)) + level) * rig.transducer.noise.value
        values[:, TY] += 0.06 * np.sin(0.2 * np.pi * np.arange(len(values)) / RATE)
        return rounded(rig, sosfilt(butter(1, corner, "highpass", fs=RATE, output="sos"), values, axis=0))

    return change


@pytest.mark.parametrize("level", [0.0, 30.0])
def test_channels_that_pass_no_slow_load_are_told(level):
    (why,) = told(still(0.3, level))
    assert "in slow readings: AC-coupled" in why and "Tx has " in why and "Ty" not in why
    assert told(still(1e-5)) == []


def test_white_noise_lacks_nothing_slow():
    rng, level = np.random.default_rng(5), np.ones(6)
    for _ in range(500):
        raw = SimpleNamespace(values=rng.standard_normal((800, 6)), dt=0.05)
        one = SimpleNamespace(run=SimpleNamespace(spectrum=object(), rates={"wrench": 20.0}), raw=raw)
        assert (slow_share(one, level, (0.05, 1.0)) == 1.0).all()


def test_two_sources_by_turns_are_told_of_which_one_is_filtered():
    (why,) = told(alternating(0.2))
    assert "Ty has " in why and "by two sources in turn" in why
    assert told(alternating(0.002)) == []


def test_what_moves_a_slow_stream_does_not_alternate():
    welch = Welch(2.5, 0.1, 100.0, ("Ty",))
    welch.push(np.sin(2.0 * np.pi * 0.3 * np.arange(500) / 2.5)[:, None], None)
    assert welch.result().alternating[0] < 0.01


def test_noise_that_nobody_states_is_not_told():
    assert told(averaged, stated=0.0) == []
