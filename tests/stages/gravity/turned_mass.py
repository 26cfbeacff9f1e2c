"""A mass beside the axis of two joints on a transducer, driven by its motion: drawn, recorded, fitted."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.campaign.load import load_campaign
from kbs_process.plant.rigid import loads
from kbs_process.reduction.settings import gravity_settings, motion_settings
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array, Block, Run
from kbs_process.stages import decouple, motion
from kbs_process.stages.align.condense import CondenseSettings, condense
from kbs_process.stages.gravity import model as gravity
from kbs_process.stages.gravity.model import GravityModel
from reduction.arm import CAMPAIGN, RIG

STEP = np.radians(0.0005)
WRENCH_HZ, ENCODER_HZ = 1000, 200
JOINT = """
[joint.{name}]
parent = "{parent}"
axis = {axis}
origin = {{ value = {origin}, unit = "m", sigma = 0.0002, source = "drawing" }}
misalignment = {{ value = 0.0, unit = "mrad", sigma = 0.2, source = "alignment" }}
[joint.{name}.encoder]
step = {{ value = 0.0005, unit = "deg", sigma = 0.0, source = "data sheet" }}
offset = {{ value = 0.0, unit = "deg", sigma = 0.0, source = "set" }}
"""
BODY = """
[body.mass]
on = "el"
mass = { value = 5.0, unit = "kg", sigma = 0.25, source = "guessed" }
cog = { value = [0.12, 0.0, 0.03], unit = "m", sigma = 0.01, source = "guessed" }
[body.mass.inertia]
value = [0.02, 0.03, 0.025, 0.0, 0.0, 0.0]
unit = "kg m^2"
sigma = [0.004, 0.004, 0.004, 0.002, 0.002, 0.002]
source = "guessed"
"""
DRAWN = ("body.mass.mass", "body.mass.cog", "body.mass.inertia")


def described(folder: Path, rate: float) -> Campaign:
    """The campaign at a working rate, its recordings not read."""
    folder.mkdir(parents=True)
    text = CAMPAIGN.replace("1.0]", f"{rate / 8.0}]").replace("= 20.0", f"= {rate}")
    rig = RIG.partition("[joint.arm]")[0].replace("sigma = [1, 1, 1, 0.1", "sigma = [0.2, 0.2, 0.2, 0.1")
    rig += JOINT.format(name="az", parent="T", axis=[0, 0, 1], origin=[0.0, 0.0, 0.1])
    rig += JOINT.format(name="el", parent="az", axis=[0, -1, 0], origin=[0.0, 0.0, 0.1])
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    (folder / "rig.toml").write_text(rig + BODY, encoding="utf-8")
    for name in ("sweep", "test"):
        (folder / f"{name}.mcap").touch()
    return load_campaign(folder, checksums=False)


def recorded(campaign: Campaign, rig: Rig, rng: np.random.Generator, seconds: float, *, slow: float = 1.0) -> Run:
    """One recording of swings that hold no frequency above 0.9 Hz / `slow`."""
    f = rng.uniform([[0.08], [0.3], [0.6]], [[0.2], [0.5], [0.9]], (3, 2)) / slow
    size, phase = np.array([[0.5], [0.2], [0.08]]), rng.uniform(0.0, 2.0 * np.pi, (3, 2))
    zero = rng.standard_normal(6) * rig.transducer.bias.sigma

    def moved(rate: float) -> tuple[Array, Array, Array, Array]:
        t = np.arange(int(seconds * rate)) / rate
        turn, w = 2.0 * np.pi * f * t[:, None, None] + phase, 2.0 * np.pi * f
        return t, *(np.sum(size * part, axis=1) for part in (np.sin(turn), w * np.cos(turn), -(w**2) * np.sin(turn)))

    def block(t: Array, values: Array) -> Block:
        stamp = np.round(1e9 * t).astype(np.int64)
        return Block(stamp, stamp, values)

    t, *moving = moved(WRENCH_HZ)
    wrench = loads(rig, *moving)[:, :6] + zero + rig.transducer.noise.value * rng.standard_normal((len(t), 6))
    turned, angle, *_ = moved(ENCODER_HZ)
    blocks = (("wrench", block(t, wrench)), ("angle", block(turned, STEP * np.round(angle / STEP))))
    settings = CondenseSettings(working_rate_Hz=campaign.bands.working_rate)
    run = condense("swings", blocks, campaign.topics.channels(), settings)
    return decouple.apply(run, decouple.fit(campaign.rig))


def fitted(campaign: Campaign, runs: list[Run]) -> GravityModel:
    """The model of these recordings."""
    samples = [
        gravity.Sample(run.name, motion.estimate(run, campaign.rig, motion_settings(campaign)), run.wrench)
        for run in runs
        if run.wrench is not None
    ]
    return gravity.fit(samples, campaign.rig, include_inertia=True, settings=gravity_settings(campaign))
