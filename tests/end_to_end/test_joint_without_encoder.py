"""A joint that no encoder reads: processed by its command, at a price that is stated, and no channel of a diagnosis."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow.parquet as pq
import pytest

from campaign.campaign_folder import CampaignFolder
from end_to_end.short_campaign import record
from kbs_process.campaign.load import load_campaign
from kbs_process.diagnosis.experiments import floor
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, predict
from kbs_process.diagnosis.nominal import phasing
from kbs_process.errors import ConfigError, RecordingError
from kbs_process.identification.estimate import Settings
from kbs_process.identification.screening import _pose
from kbs_process.plant.laws import select
from kbs_process.plant.linear.modes import modes
from kbs_process.progress import SilentProgress
from kbs_process.reduction.predicting import schedule_of
from kbs_process.reduction.reading import read_run
from kbs_process.reduction.settings import motion_settings
from kbs_process.signals.records import Events, Signal
from kbs_process.stages.motion import estimate
from kbs_process.studies.correlate.run import process
from kbs_process.studies.diagnose.reading import experiment_of
from kbs_process.studies.identify.run import identify

pytestmark = pytest.mark.slow

TOPIC = 'encoder = "/encoder"'
READ = 'encoder = { topic = "/encoder", joints = ["el"] }'


@pytest.fixture
def folder(folder: CampaignFolder) -> CampaignFolder:
    """Recordings whose encoders read elevation alone."""
    for number, path in enumerate(sorted((folder.path / "recordings").iterdir())):
        record(path, noise=0.01, seed=number, read=("el",))
    folder.replace("campaign.toml", TOPIC, READ)
    return folder


def test_it_is_where_its_command_is_and_the_budget_says_how_well(folder: CampaignFolder, tmp_path: Path) -> None:
    campaign = load_campaign(folder.path, checksums=False)
    assert campaign.topics.angle is not None
    assert (campaign.topics.angle.channels, campaign.topics.angle.fields) == (("el",), ("position[el]",))
    process(campaign, tmp_path / "out", progress=SilentProgress(), page=False)
    table = pq.read_table(tmp_path / "out" / "tables" / "aligned" / "EL089P00_1.parquet")
    assert [name for name in table.column_names if name.startswith("angle.")] == ["angle.el"]
    items = json.loads((tmp_path / "out" / "results.json").read_text())["budget"]
    of_angles = [
        item["sigma"]
        for entry in items
        for item in entry["contributions"]
        if entry["channel"] in ("Tx", "Ty") and entry["frame"] == "T" and "missed motion" in item["source"]
    ]
    assert min(of_angles) > 5e-4  # N m: half a milliradian times the static torque across azimuth's axis


def test_its_motion_is_the_command_s(folder: CampaignFolder) -> None:
    campaign = load_campaign(folder.path, checksums=False)
    run = read_run(campaign, campaign.recordings[1])
    moved = estimate(run, campaign.rig, motion_settings(campaign))
    assert moved.history[0] == "az: command alone, sigma 0.0005 rad"
    assert "command alone" not in moved.history[1]
    np.testing.assert_allclose(moved.q[:, 0], 0.0, atol=1e-12)
    assert moved.missed[0] == 5e-4
    np.testing.assert_array_equal(moved.sigma_q[:, 0], 5e-4)


def test_a_diagnosis_has_no_channel_for_it(folder: CampaignFolder) -> None:
    campaign = load_campaign(folder.path, checksums=False)
    experiment = experiment_of(campaign, SilentProgress())
    assert experiment.channels == (*campaign.rig.channels, "el")
    hypothesis = Hypothesis(experiment.rig, experiment.effects)
    found = predict(hypothesis, experiment, 0)
    assert found.values.shape[1] == len(experiment.channels)
    left = {
        k: trial.measured - predict(hypothesis, experiment, trial.drive).values
        for k, trial in enumerate(experiment.trials)
    }
    assert floor.estimate(experiment, left).level.shape[1] == len(experiment.channels)


def test_resonances_are_those_of_the_commanded_pose(folder: CampaignFolder) -> None:
    """As seen by the search for phases: elevation must not pass for azimuth."""
    campaign = load_campaign(folder.path, checksums=False)
    experiment = experiment_of(campaign, SilentProgress())
    recording = phasing._measured(experiment, 1)
    assert recording.angle.shape[1] == 1
    pose = _pose(recording, 2)
    np.testing.assert_allclose(pose, [0.0, 1.3], atol=0.1)
    assert modes(campaign.rig, select(campaign.effects), pose)


def test_a_closed_loop_is_not_fed_with_half_of_its_readings(folder: CampaignFolder) -> None:
    campaign = load_campaign(folder.path, checksums=False)
    t = 0.1 * np.arange(100)
    run = SimpleNamespace(
        name="run",
        command=Events(t, np.zeros((100, 4)), ("az", "el", "az.rate", "el.rate")),
        field=None,
        encoder=Events(t, np.zeros((100, 1)), ("el",)),
    )
    assert schedule_of(run, campaign.rig).encoder is None


def test_an_identification_needs_it(folder: CampaignFolder, tmp_path: Path) -> None:
    campaign = load_campaign(folder.path, checksums=False)
    with pytest.raises(RecordingError, match="az is not read") as caught:
        identify(campaign, tmp_path / "out", settings=Settings(), progress=SilentProgress())
    assert "topics.encoder" in caught.value.remedy


def test_a_motion_that_nothing_measures_is_refused(folder: CampaignFolder) -> None:
    folder.replace("campaign.toml", 'drive = "command"', 'drive = "motion"')
    with pytest.raises(ConfigError, match="leaves out az") as caught:
        load_campaign(folder.path, checksums=False)
    assert "topics.encoder.joints" in str(caught.value)


def test_fields_stand_for_the_joints_that_are_read(folder: CampaignFolder) -> None:
    with_fields = 'encoder = { topic = "/encoder", joints = ["el"], fields = ["position[0]"] }'
    folder.replace("campaign.toml", READ, with_fields)
    campaign = load_campaign(folder.path, checksums=False)
    run = read_run(campaign, campaign.recordings[1])
    assert run.angle is not None
    assert run.angle.channels == ("el",)
    assert abs(run.angle.values.mean() - 1.3) < 0.1


def test_a_rate_stands_for_an_angle_that_is_not_read(folder: CampaignFolder) -> None:
    campaign = load_campaign(folder.path, checksums=False)
    run = read_run(campaign, campaign.recordings[1])
    assert run.angle is not None
    turning = np.full((len(run.angle), 2), 0.01)
    lost = run.angle.valid & (run.angle.t > 15.0)
    rate = Signal(0.0, run.angle.dt, turning, ("az", "el"), ("rad/s",) * 2, "joint", ~lost)
    moved = estimate(replace(run, rate=rate), campaign.rig, motion_settings(campaign))
    np.testing.assert_allclose(np.ptp(moved.q[:, 0]), 0.2, rtol=0.05)
    np.testing.assert_allclose(moved.q[:, 1].mean(), 1.3, atol=0.1)
    assert not moved.valid[lost].any()
