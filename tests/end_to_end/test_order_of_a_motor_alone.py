"""An order of a joint without a gear is found as such in few of its periods, which a motion of one sense shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

import kbs_process
from kbs_process.campaign.config import Campaign
from kbs_process.recordings.mcap.messages.encoding import OutStream
from kbs_process.recordings.mcap.writer import write_mcap

ORDER, AMPLITUDE, NOISE = 20.0, 1.0, 0.02  # 1/turn, N m
CAMPAIGN = """
schema = 1
name = "motor"
title = "A motor alone"
drive = "motion"
[bands]
high_pass_Hz = 0.0
low_pass_Hz = [1.0]
working_rate_Hz = 10.0
[topics]
effort = "/motor"
encoder = "/motor"
[parameters]
files = ["rig.toml"]
[[recording]]
file = "fit.mcap"
trajectory = "fit"
role = "fit"
repeat = 1
[[recording]]
file = "held-out.mcap"
trajectory = "held-out"
role = "held-out"
repeat = 1
"""
RIG = """
[gravity]
magnitude = { value = 9.80665, unit = "m/s^2", sigma = 0.0, source = "standard" }
[joint.m]
parent = "lab"
axis = [0, 0, 1]
origin = { value = 0.0, unit = "m", sigma = 0.0, source = "definition" }
misalignment = { value = 0.0, unit = "rad", sigma = 0.0, source = "definition" }
[joint.m.encoder]
step = { value = 1e-6, unit = "rad", sigma = 0.0, source = "digits" }
offset = { value = 0.0, unit = "rad", sigma = 0.0, source = "definition" }
[joint.m.effort]
gain = { value = 1.0, unit = "1", sigma = 0.0, source = "torque" }
bias = { value = 0.0, unit = "N m", sigma = 1.0, source = "estimate" }
noise = { value = 0.02, unit = "N m", sigma = 0.0, source = "estimate" }
resolution = { value = 0.0, unit = "N m", sigma = 0.0, source = "digits" }
[body.rotor]
on = "m"
mass = { value = 1.0, unit = "kg", sigma = 0.0, source = "scales" }
cog = { value = 0.0, unit = "m", sigma = 0.0, source = "balanced" }
inertia = { value = [0.0, 0.0, 0.01, 0.0, 0.0, 0.0], unit = "kg m^2", sigma = 0.0, source = "drawing" }
"""


def written(folder: Path, campaign: str, rig: str, recordings: Mapping[str, Sequence[np.ndarray]]) -> Campaign:
    """A campaign of recordings by role: times (s), angles (rad) and efforts (N m)."""
    folder.mkdir()
    (folder / "campaign.toml").write_text(campaign, encoding="utf-8")
    (folder / "rig.toml").write_text(rig, encoding="utf-8")
    for role, (t, angle, effort) in recordings.items():
        stamp = np.rint(t * 1e9).astype(np.int64)
        values = np.column_stack([angle, np.zeros(len(stamp)), effort])
        write_mcap(folder / f"{role}.mcap", [OutStream("/motor", "joints", stamp, stamp, values, ("m",))])
    return kbs_process.load_campaign(folder, checksums=False)


def recorded(folder: Path, rate: float) -> Campaign:
    """A minute at a rate (rad/s), twice."""
    rng = np.random.default_rng(1)
    t = np.arange(600) * 0.1
    recordings = {
        role: (t, rate * t, AMPLITUDE * np.sin(ORDER * rate * t) + NOISE * rng.standard_normal(len(t)))
        for role in ("fit", "held-out")
    }
    return written(folder, CAMPAIGN, RIG, recordings)


@pytest.mark.slow
def test_a_rig_of_which_all_is_known_is_processed(tmp_path: Path) -> None:
    found = kbs_process.process(recorded(tmp_path / "motor", 0.02), tmp_path / "out")
    assert "m.effort" in {one.channel for one in found.merit}


@pytest.mark.slow
@pytest.mark.parametrize("rate", [0.02, 0.05])  # 3.8 and 9.5 periods
def test_an_order_is_found_in_few_periods(tmp_path: Path, rate: float) -> None:
    found = kbs_process.diagnose(recorded(tmp_path / "motor", rate), tmp_path / "out")
    (law,) = found.finds
    numbers = {one.name: one for one in law.parameters}
    assert (law.name, law.place.site) == ("motor_order", "m")
    assert numbers["order"].value == pytest.approx(ORDER, abs=0.05)
    amplitude = np.hypot(numbers["order_sin"].value, numbers["order_cos"].value)
    assert amplitude == pytest.approx(AMPLITUDE, abs=4.0 * numbers["order_sin"].sigma)


@pytest.mark.validation
def test_a_harness_is_not_found_where_there_is_none(tmp_path: Path) -> None:
    """Friction of 20 N m and an order of 1.5 N m are left out, and the angle is stamped 8 ms late."""
    late, order = 8e-3, 202.0
    rng = np.random.default_rng(11)
    t = np.arange(0.0, 30.0, 0.01)
    recordings = {}
    for phase, role in ((0.0, "fit"), (0.7, "held-out")):
        q = -1.0 + 1.55 * np.sin(2.0 * np.pi * t / 10.1 + phase)
        v = np.gradient(q, t)
        acts = 3.0 * np.gradient(v, t) + 15.0 * v + 20.0 * np.tanh(v / 0.02) + 1.5 * np.sin(order * q + 0.4)
        recordings[role] = (t, np.interp(t - late, t, q), acts + 2.0 * rng.standard_normal(len(t)))
    drive = 'viscous = { value = 15.0, unit = "N m s/rad", sigma = 30.0, source = "estimate" }\n[joint.m.encoder]'
    inertia = '0.0, 0.0, 3.0, 0.0, 0.0, 0.0], unit = "kg m^2", sigma = [0.0, 0.0, 3.0, 0.0, 0.0, 0.0]'
    rig = (
        RIG.replace("[joint.m.encoder]", drive)
        .replace("value = 0.02", "value = 2.0")
        .replace('0.0, 0.0, 0.01, 0.0, 0.0, 0.0], unit = "kg m^2", sigma = 0.0', inertia)
    )
    campaign = CAMPAIGN.replace("[1.0]", "[30.0]").replace("working_rate_Hz = 10.0", "working_rate_Hz = 240.0")
    found = kbs_process.diagnose(written(tmp_path / "drive", campaign, rig, recordings), tmp_path / "out")
    assert {"coulomb", "stribeck"} & {one.name for one in found.finds}
    assert "harness" not in {one.name for one in found.finds}
    for one in found.finds:
        assert any(abs(number.value) > 2.0 * number.sigma > 0.0 for number in one.parameters), one.name
