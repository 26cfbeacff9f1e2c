"""An arm about a horizontal axis on a transducer, as the tutorial has it: described, drawn, and recorded."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.campaign.load import load_campaign
from kbs_process.progress import SilentProgress
from kbs_process.reduction.preparing import Prepared, fit_gravity
from kbs_process.reduction.settings import motion_settings
from kbs_process.reduction.soundness.checking import Checked, check_model
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array
from kbs_process.stages import decouple, motion
from stages.gravity.synthetic import FINE, perturbed, record

CAMPAIGN = """
schema = 1
name = "ARM"
title = "An arm about a horizontal axis"
drive = "motion"
[[requirement]]
name = "Disturbance torque"
quantity = "torque"
frame = "T"
statistic = "peak"
limit = { value = 0.03, unit = "N m" }
band_Hz = [0.05, 1.0]
source = "test"
[bands]
high_pass_Hz = 0.05
low_pass_Hz = [1.0]
working_rate_Hz = 20.0
[topics]
wrench = "/transducer/wrench"
encoder = "/encoder"
[parameters]
files = ["rig.toml"]
[[recording]]
file = "sweep.mcap"
trajectory = "sweep"
role = "calibration"
[[recording]]
file = "test.mcap"
trajectory = "test"
role = "held-out"
"""
RIG = """
[gravity]
magnitude = { value = 9.80665, unit = "m/s^2", sigma = 0.0, source = "standard" }
[transducer]
on = "lab"
channels = ["Fx", "Fy", "Fz", "Tx", "Ty", "Tz"]
tilt = { value = 0.0, unit = "mrad", sigma = 0.5, source = "level" }
cross_coupling = { value = 0.0, unit = "SI by channel pair", sigma = 1e-4, source = "certificate" }
bias = { value = 0.0, unit = "SI by channel", sigma = [1, 1, 1, 0.1, 0.1, 0.1], source = "tared" }
noise = { value = [0.02, 0.02, 0.02, 0.002, 0.002, 0.002], unit = "SI by channel", sigma = 0.0, source = "weight" }
resolution = { value = 0.0, unit = "SI by channel", sigma = 0.0, source = "fine" }
[joint.arm]
parent = "T"
axis = [0, -1, 0]
origin = { value = [0.0, 0.0, 0.2], unit = "m", sigma = 0.0005, source = "drawing" }
misalignment = { value = 0.0, unit = "mrad", sigma = 0.5, source = "alignment" }
[body.arm]
on = "arm"
mass = { value = 5.0, unit = "kg", sigma = 0.1, source = "scales" }
cog = { value = [0.12, 0.0, 0.0], unit = "m", sigma = 0.003, source = "drawing" }
inertia = { value = 0.0, unit = "kg m^2", sigma = 0.002, source = "a small weight" }
"""


def described(folder: Path) -> Campaign:
    """The campaign of an arm, its recordings not read."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    (folder / "rig.toml").write_text(RIG, encoding="utf-8")
    for name in ("sweep", "test"):
        (folder / f"{name}.mcap").touch()
    return load_campaign(folder, checksums=False)


def drawn(campaign: Campaign, seed: int) -> Rig:
    """The arm as it might truly be."""
    return perturbed(campaign.rig, np.random.default_rng(seed), names=(".mass", ".cog", ".tilt", ".misalignment"))


def swing(seconds: float = 120.0, period: float = 30.0) -> Array:
    """Angle (n, 1) rad at the encoder's rate."""
    t = np.arange(int(seconds * FINE)) / FINE
    return (0.6 - 0.6 * np.cos(2.0 * np.pi * t / period))[:, None]


def recorded(
    campaign: Campaign,
    rig: Rig,
    seed: int,
    *,
    reads: Array | None = None,
    angle: float = 1.0,
    zero: float = 0.0,
    period: float = 30.0,
) -> list[Prepared]:
    """Both recordings of a rig, the wrench as `reads` (6, 6) makes it, angles times `angle` and `zero` rad more."""
    found = []
    decoupling = decouple.fit(campaign.rig)
    for index, entry in enumerate(campaign.recordings):
        rng = np.random.default_rng([seed, index])
        run = record(rig, entry.name, swing(period=period), rng)
        assert run.wrench is not None and run.angle is not None
        wrench = run.wrench.derive(run.wrench.values @ (np.eye(6) if reads is None else reads).T, "read")
        turned = run.angle.derive(run.angle.values * angle + zero, "read")
        run = replace(run, wrench=wrench, angle=turned, command=None)
        moved = motion.estimate(run, campaign.rig, motion_settings(campaign))
        found.append(Prepared(entry, wrench, decouple.apply(run, decoupling), moved))
    return found


def checked(campaign: Campaign, recordings: list[Prepared]) -> Checked:
    """What is found of the model of the rig."""
    model = fit_gravity(campaign, recordings, SilentProgress())
    return check_model(campaign, recordings, model, SilentProgress())
