"""`predict --model`: a corrected model alone, on recordings and commands that nobody used."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from campaign.campaign_folder import make_folder
from end_to_end.short_campaign import record
from kbs_process import cli
from kbs_process.campaign.config import SensingLaw
from kbs_process.campaign.load import load_campaign
from kbs_process.campaign.locate import CAMPAIGN_FILE
from kbs_process.campaign.writing.corrected_model import write_model
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis
from kbs_process.diagnosis.proposing.measured import inserted
from kbs_process.plant.laws.position.measured_law import MEASURED
from kbs_process.reduction.inspection import inspect_recording
from kbs_process.results.store import writing
from kbs_process.rig.model import Quantity
from kbs_process.signals.records import Array

pytestmark = pytest.mark.slow

PULL = 0.5  # N m about elevation, from the laboratory
GAIN = 0.02  # of Fz


def run(*arguments: str) -> int:
    with pytest.raises(SystemExit) as caught:
        cli.main((*arguments, "-q"))
        sys.exit(0)
    return int(caught.value.code or 0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A campaign, a model that corrects it, far from it, and a recording of neither."""
    top = tmp_path_factory.mktemp("predict")
    campaign = load_campaign(make_folder(top / "campaigns" / "EL089").path)
    law, ends = next(one for one in MEASURED if one.effect.name == "ground_angle_law"), (1.0, 1.6)
    hypothesis, _ = inserted(
        Hypothesis(campaign.rig, campaign.effects), law, "el", ends, np.full(10, PULL), np.full(10, 0.01)
    )
    gain = Quantity("sensing.Fz.channel_gain.gain", np.asarray(GAIN), "1", np.asarray(1e-3), "a test")
    sensing = [SensingLaw("channel_gain", "Fz", {"gain": gain})]
    write_model(campaign, hypothesis.rig, hypothesis.effects, {}, top / "made", "by a test", sensing)
    shutil.move(top / "made", top / "elsewhere" / "deeper" / "corrected")
    record(top / "other.mcap")
    return top


def table(path: Path, *columns: str) -> Array:
    found = pq.read_table(path)
    return np.stack([found[name].to_numpy() for name in columns], axis=1)


def test_a_recording_that_nobody_used(folder: Path) -> None:
    other, bare, whole = str(folder / "other.mcap"), folder / "bare", folder / "whole"
    assert run("predict", str(folder / "campaigns" / "EL089"), other, "-o", str(bare)) == 0
    model = str(folder / "elsewhere" / "deeper" / "corrected")
    assert run("predict", "--model", model, other, "-o", str(whole)) == 0
    before, after = (table(one / "wrench.parquet", "Fz", "Ty") for one in (bare, whole))
    late = slice(len(before) // 2, None)
    change = (after - before)[late]
    np.testing.assert_allclose(change[:, 0], GAIN * before[late, 0], rtol=0.02)
    np.testing.assert_allclose(np.abs(change[:, 1].mean()), PULL, rtol=0.05)
    angles = [table(one / "angle.parquet", "el")[late] for one in (bare, whole)]
    # The gear gives by the pull over its stiffness, 5e-5 rad: the encoder shows it.
    assert 1e-5 < np.abs(np.mean(angles[1] - angles[0])) < 1e-3
    about = json.loads(pq.read_schema(whole / "wrench.parquet").metadata[b"kbs"])
    assert "read through channel_gain at Fz" in about["history"]
    inspected = inspect_recording(whole / "predicted.mcap")
    assert inspected.state == "clean", inspected
    with writing(folder / "bench", CAMPAIGN_FILE) as imported:
        (imported / CAMPAIGN_FILE).write_text("mine")
    assert run("predict", "--model", model, other, "-o", str(folder / "bench")) == 2
    assert (folder / "bench" / CAMPAIGN_FILE).read_text() == "mine"
    assert run(str(folder / "campaigns" / "EL089"), "-o", str(whole)) == 2
    assert (whole / "predicted.mcap").is_file()
    assert run("predict", "--model", model, other, "-o", str(whole)) == 0


def test_commands_of_a_table(folder: Path) -> None:
    t = np.arange(0.0, 3.01, 0.1)
    rows = [f"{time:.1f},0.0,{1.3 + 1e-3 * max(0.0, time - 1.0):.6f}" for time in t]
    (folder / "slew.csv").write_text("t,az,el\n" + "\n".join(rows) + "\n")
    model = str(folder / "elsewhere" / "deeper" / "corrected")
    assert run("predict", "--model", model, str(folder / "slew.csv"), "-o", str(folder / "slew")) == 0
    assert len(table(folder / "slew" / "angle.parquet", "el")) == 300
    assert (folder / "slew" / "simulated.mcap").is_file()


@pytest.mark.parametrize("verb", ["simulate", "flight"])
def test_other_verbs_need_no_recordings_where_commands_are_given(folder: Path, verb: str) -> None:
    t = np.arange(0.0, 12.01, 0.1)
    rows = [f"{time:.1f},0.0,{1.3 + 1e-3 * max(0.0, time - 1.0):.6f}" for time in t]
    (folder / "long.csv").write_text("t,az,el\n" + "\n".join(rows) + "\n")
    model, out = str(folder / "elsewhere" / "deeper" / "corrected"), folder / verb
    options = ["--samples", "2", "--no-pdf"] if verb == "flight" else []
    assert run(verb, model, "--command", str(folder / "long.csv"), "-o", str(out), *options) == 0
    if verb == "flight":
        inputs = json.loads((out / "results.json").read_text())["provenance"]["inputs"]
        assert not [entry["file"] for entry in inputs if entry["file"].endswith(".mcap")]


def test_what_is_wrong_is_told(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = str(folder / "elsewhere" / "deeper" / "corrected")
    assert run("predict", "--model", model, "nowhere.mcap") == 2
    assert "no such file" in capsys.readouterr().err
    assert run("predict", "other.mcap") == 2
    assert "--model FOLDER" in capsys.readouterr().err
