"""What the zero of a sensor may be says nothing of how it drifts: "not tared" takes no slow load off a recording."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kbs_process
from kbs_process.recordings.mcap.messages.encoding import OutStream
from kbs_process.recordings.mcap.writer import write_mcap

NOISE = np.array([0.03, 0.03, 0.03, 0.002, 0.002, 0.002])  # N, N m
ZERO = np.array([9.0, -1.0, 10.0, 0.4, -0.7, -0.1])
CAMPAIGN = """
schema = 1
name = "tool"
title = "A tool on a sensor, turned by half a turn"
drive = "motion"
[bands]
high_pass_Hz = 0.0
low_pass_Hz = [2.0]
working_rate_Hz = 100.0
[topics]
wrench = "/wrench"
encoder = "/angles"
[parameters]
files = ["rig.toml"]
[[recording]]
file = "fit.mcap"
trajectory = "fit"
role = "fit"
[[recording]]
file = "held-out.mcap"
trajectory = "held-out"
role = "held-out"
"""
RIG = """
[gravity]
magnitude = {{ value = 9.81, unit = "m/s^2", sigma = 0.0, source = "table" }}
[transducer]
on = "wrist"
channels = ["Fx", "Fy", "Fz", "Tx", "Ty", "Tz"]
tilt = {{ value = 0.0, unit = "rad", sigma = 0.02, source = "drawing" }}
cross_coupling = {{ value = 0.0, unit = "SI by channel pair", sigma = 0.02, source = "certificate" }}
bias = {{ value = 0.0, unit = "SI by channel", sigma = {bias}, source = "data sheet" }}
noise = {{ value = [0.03, 0.03, 0.03, 0.002, 0.002, 0.002], unit = "SI by channel", sigma = 0.0, source = "rest" }}
resolution = {{ value = 0.0, unit = "SI by channel", sigma = 0.0, source = "fine" }}
[joint.wrist]
parent = "lab"
axis = [0, 1, 0]
origin = {{ value = 0.0, unit = "m", sigma = 0.0, source = "definition" }}
misalignment = {{ value = 0.0, unit = "rad", sigma = 0.0, source = "definition" }}
[joint.wrist.encoder]
step = {{ value = 1e-6, unit = "rad", sigma = 0.0, source = "digits" }}
offset = {{ value = 0.0, unit = "rad", sigma = 0.0, source = "definition" }}
[body.tool]
on = "T"
mass = {{ value = 1.0, unit = "kg", sigma = 0.3, source = "guess" }}
cog = {{ value = [0.0, 0.0, 0.05], unit = "m", sigma = [0.02, 0.02, 0.6], source = "guess" }}
inertia = {{ value = [0.1, 0.1, 0.1, 0.0, 0.0, 0.0], unit = "kg m^2", sigma = 0.3, source = "guess" }}
"""


def turned(rng: np.random.Generator) -> list[OutStream]:
    """A tool of 0.95 kg whose centre is 0.25 m from the axis: rest, half a turn within 5 s, rest."""
    mass, arm, dt = 0.95, 0.25, 0.005
    t = np.arange(0.0, 6.2, dt)
    s = np.clip((t - 0.4) / 4.8, 0.0, 1.0)
    q = np.pi * (10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5) - 0.5 * np.pi
    rate = np.gradient(q, dt)
    force = mass * (9.81 * np.sin(q) - arm * np.gradient(rate, dt)), mass * (arm * rate**2 - 9.81 * np.cos(q))
    values = ZERO + NOISE * rng.standard_normal((len(t), 6))
    values[:, 0] += 1.02 * force[0]
    values[:, 2] += 0.99 * force[1]
    values[:, 4] += arm * force[0]
    stamp = np.rint(1e9 * t).astype(np.int64)
    angle = np.column_stack([q, rate])
    return [
        OutStream("/wrench", "wrench", stamp, stamp, values, ()),
        OutStream("/angles", "joints", stamp, stamp, angle, ("wrist",)),
    ]


@pytest.mark.slow
def test_a_zero_that_is_not_known_drifts_no_more_than_one_that_is(tmp_path: Path) -> None:
    left = {}
    for name, bias in (("not tared", [20.0] * 3 + [2.0] * 3), ("known", [12.0] * 3 + [1.0] * 3)):
        folder, rng = tmp_path / name, np.random.default_rng(2)
        folder.mkdir()
        (folder / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
        (folder / "rig.toml").write_text(RIG.format(bias=bias), encoding="utf-8")
        for role in ("fit", "held-out"):
            write_mcap(folder / f"{role}.mcap", turned(rng))
        campaign = kbs_process.load_campaign(folder, checksums=False)
        found = kbs_process.process(campaign, tmp_path / "out" / name)
        left[name] = {
            one.channel: one.residual_rms
            for one in found.merit
            if one.recording.startswith("held-out") and one.channel in ("Fx", "Fz")
        }
    floor = NOISE[0] * np.sqrt(2.0 / 100.0)  # of white noise to 100 Hz, below 2 Hz
    assert max(left["not tared"].values()) < 1.4 * floor
    assert left["not tared"] == pytest.approx(left["known"], rel=0.02)
