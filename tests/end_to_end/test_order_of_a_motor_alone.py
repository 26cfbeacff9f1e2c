"""An order of a joint without a gear is found as such in few of its periods, which a motion of one sense shows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kbs_process
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


def recorded(folder: Path, rate: float) -> kbs_process.Campaign:
    """A minute at a rate (rad/s), twice."""
    rng = np.random.default_rng(1)
    folder.mkdir()
    (folder / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    (folder / "rig.toml").write_text(RIG, encoding="utf-8")
    for role in ("fit", "held-out"):
        stamp = np.arange(600) * 100_000_000
        angle = rate * 1e-9 * stamp
        effort = AMPLITUDE * np.sin(ORDER * angle) + NOISE * rng.standard_normal(len(stamp))
        values = np.column_stack([angle, np.zeros(len(stamp)), effort])
        write_mcap(folder / f"{role}.mcap", [OutStream("/motor", "joints", stamp, stamp, values, ("m",))])
    return kbs_process.load_campaign(folder, checksums=False)


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
