"""The antenna on a bungee: the plant against the independent engine, on the hardware behind AL012M00's recordings."""

from __future__ import annotations

import numpy as np
import pytest

from engine import TRAJECTORIES, simulate
from engine.campaigns import ABOVE_ANTENNA, CAMPAIGNS
from kbs_process.campaign.load import load_campaign
from kbs_process.plant.attach import attach
from kbs_process.plant.laws.environment.bungee import BUNGEE
from kbs_process.plant.schedule import Schedule
from kbs_process.rig.model import substitute
from plant.plant_rigs import CODE, streams

pytestmark = pytest.mark.slow

UNTIL = 30.0
NOISE = np.array([0.02] * 3 + [0.002] * 3)  # rms a sample at 100 Hz


def test_wrench_and_angles_agree_on_a_cord() -> None:
    campaign = CAMPAIGNS["AL012M00"]
    hardware = campaign.hardware().with_values({"bungee": ABOVE_ANTENNA})
    commands = TRAJECTORIES["AL012M00"]().until(UNTIL)
    theirs = simulate(hardware, commands, rate_hz=100.0)
    described = load_campaign(campaign.folder)
    names = described.rig.quantities().keys() & hardware.values.keys()
    assert len(names) > 60
    of = substitute(described.rig, {name: hardware[name] for name in names})
    anchor = dict(zip(("anchor_x", "anchor_y", "anchor_z"), ABOVE_ANTENNA.anchor, strict=True))
    cord = {"stiffness": ABOVE_ANTENNA.stiffness, "free_length": ABOVE_ANTENNA.free_length}
    hung, free = (
        streams(
            attach(of, BUNGEE, anchor | cord | changed, on="el", point=hardware["body.antenna.cog"]),
            (*described.effects, BUNGEE.name),
            Schedule(commands.t, commands.position, commands.rate),
            rate_Hz=100.0,
            angle_rate_Hz=100.0,
            duration_s=UNTIL,
            quantise=False,
        )
        for changed in ({}, {"stiffness": 0.0})
    )
    n = len(hung["wrench"])
    wrench = (hung["wrench"] - theirs.wrench[:n]) / NOISE
    offset = np.array([hardware.scalar(f"joint.{axis}.encoder.offset") for axis in ("az", "el")])
    angle = (hung["angle"] - offset - theirs.angles[:n]) / CODE
    swing = (hung["wrench"] - free["wrench"]).std(axis=0) / NOISE
    rms = np.sqrt((wrench**2).mean(axis=0))
    print("\nwrench, rms of the difference in sensor noise:", rms.round(4), "greatest", np.abs(wrench).max())
    print("angles, greatest in codes:", np.abs(angle).max(axis=0), "\nthe cord's own, in sensor noise:", swing)
    assert rms.max() < 0.1
    assert np.abs(wrench).max() < 0.75
    assert np.abs(angle).max() < 0.01
    assert swing.max() > 20.0
