"""A rig whose loads are the efforts of its joints: what its description may say, and what it may not."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from campaign.campaign_folder import CampaignFolder, make_folder
from kbs_process.campaign.load import load_campaign
from kbs_process.campaign.writing.corrected_model import write_model
from kbs_process.errors import ConfigError
from kbs_process.plant.attach import attach
from kbs_process.plant.laws import select
from kbs_process.reduction.relief import in_motion, without_effects
from kbs_process.signals.records import Signal
from kbs_process.stages.motion import Motion
from kbs_process.studies.convert import PRESETS

RECORDING = """
[[recording]]
file = "run.mcap"
trajectory = "run"
role = "fit"
"""


CURRENT = """
[joint.axis.effort]
gain = { value = 50.0, unit = "N/A", sigma = 5.0, source = "test" }
bias = { value = 20.0, unit = "mA", sigma = 10.0, source = "test" }
noise = { value = 0.1, unit = "A", sigma = 0.0, source = "test" }
resolution = { value = 0.0, unit = "A", sigma = 0.0, source = "test" }
"""


@pytest.fixture
def axis(tmp_path: Path) -> CampaignFolder:
    shutil.copytree(PRESETS / "emps", tmp_path, dirs_exist_ok=True)
    (tmp_path / "run.mcap").touch()
    folder = CampaignFolder(tmp_path)
    folder.append("campaign.toml", RECORDING)
    return folder


def test_a_linear_axis_has_metres_and_newtons(axis: CampaignFolder) -> None:
    campaign = load_campaign(axis.path)
    rig, topics = campaign.rig, campaign.topics
    assert topics.wrench is None
    assert (topics.effort.fields, topics.effort.channels, topics.effort.units) == (
        ("effort[axis]",),
        ("axis.effort",),
        ("N",),
    )
    assert topics.angle.units == ("m",)
    assert rig.channels == ("axis.effort",)
    assert rig.quantities()["joint.axis.viscous"].unit == "N s/m"


def test_a_current_needs_the_gain_of_its_joints_type(axis: CampaignFolder) -> None:
    rig = axis.path / "parameters/rig.toml"
    before, _, after = rig.read_text().partition("[joint.axis.effort]")
    rig.write_text(before + CURRENT + after[after.index("[body.car]") :])
    assert load_campaign(axis.path).topics.effort.units == ("A",)
    axis.replace("parameters/rig.toml", '"N/A"', '"N m/A"')
    assert "is the unit of no gain" in str(axis.refusal())


@pytest.mark.parametrize(
    ("file", "old", "new", "what"),
    [
        ("campaign.toml", 'effort = "/motor"', "", "topics.effort: is missing"),
        ("campaign.toml", 'effort = "/motor"', 'effort = "/motor"\nwrench = "/wrench"', "transducer: is missing"),
        ("parameters/rig.toml", '"prismatic"', '"helical"', "'helical' is not allowed"),
        ("parameters/rig.toml", 'unit = "N s/m"', 'unit = "N m s/rad"', "where linear damping"),
        ("parameters/rig.toml", 'parent = "lab"', 'parent = "T"', "'T' is no other link"),
    ],
)
def test_contradictions_are_refused(axis: CampaignFolder, file: str, old: str, new: str, what: str) -> None:
    axis.replace(file, old, new)
    assert what in str(axis.refusal())


def test_what_only_a_measured_motion_can_drive_is_refused_under_commands(tmp_path: Path) -> None:
    folder = make_folder(tmp_path)
    viscous = 'viscous = { value = 1.0, unit = "N m s/rad", sigma = 0.0, source = "test" }'
    folder.replace("parameters/rig.toml", "[joint.az]", f"[joint.az]\n{viscous}")
    assert "joint.az.viscous: goes with a rig that its measured motion drives" in str(folder.refusal())


def test_a_corrected_model_of_a_slide_has_newtons_and_metres_and_loads(axis: CampaignFolder, tmp_path: Path) -> None:
    campaign = load_campaign(axis.path)
    (dahl,) = select(["dahl"])
    rig = attach(campaign.rig, dahl, {"dahl": 3.0, "dahl_displacement": 1e-3})
    folder = tmp_path / "corrected"
    write_model(campaign, rig, ("dahl",), {}, folder, "by a test")
    found = load_campaign(folder, recordings=False).rig.quantities()
    assert found["joint.axis.drive.dahl"].unit == "N"
    assert found["joint.axis.drive.dahl_displacement"].unit == "m"
    # One that turned by commands would need a rotor.
    text = (folder / "campaign.toml").read_text().replace('drive = "motion"', 'drive = "command"')
    (folder / "campaign.toml").write_text(text)
    with pytest.raises(ConfigError, match="a rotor of its own"):
        load_campaign(folder, recordings=False)


def test_effects_of_the_model_act_along_a_measured_motion(axis: CampaignFolder, tmp_path: Path) -> None:
    """What a corrected model says of friction is predicted, and is not fitted as weight or inertia."""
    campaign = load_campaign(axis.path)
    (coulomb,) = select(["coulomb"])
    rig = attach(campaign.rig, coulomb, {"coulomb": 3.0})
    folder = tmp_path / "corrected"
    write_model(campaign, rig, ("coulomb",), {}, folder, "by a test")
    corrected = load_campaign(folder, recordings=False)
    t = 0.01 * np.arange(1000)
    q = 0.1 * np.sin(t)[:, None]
    still = np.zeros_like(q)
    motion = Motion(
        0.0, 0.01, q, 0.1 * np.cos(t)[:, None], still, still, still[None], np.zeros(1), np.zeros(1), t >= 0.0
    )
    entry = campaign.recordings[0]
    friction = in_motion(corrected, entry, motion, rig.channels, corrected.rig)[:, 0]
    moving = np.abs(np.cos(t)) > 0.2
    np.testing.assert_allclose(friction[moving], 3.0 * np.sign(np.cos(t))[moving], rtol=0.02)
    effort = Signal(0.0, 0.01, friction[:, None], rig.channels, ("N",), "joint", t >= 0.0)
    assert not without_effects(corrected, entry, motion, effort, corrected.rig).values.any()
    assert not in_motion(campaign, entry, motion, rig.channels, campaign.rig).any()
