"""The stability verb: results, report and verdict of an archived campaign."""

from __future__ import annotations

import json
from pathlib import Path

import jsonschema
import pytest

from kbs_process.campaign.load import load_campaign
from kbs_process.errors import ConfigError
from kbs_process.progress import SilentProgress
from kbs_process.studies.stability.run import Simulations, analyse_stability

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[3]


def test_a_campaign_is_analysed_and_reported(tmp_path: Path) -> None:
    few = Simulations(poses=1, weights=(1.0,), shares=(0.5,))
    campaign = load_campaign(ROOT / "campaigns" / "EL089", checksums=False)
    settings = {"joint": None, "low_deg": 0.0, "high_deg": 80.0, "points": 2, "pdf": False}
    outcome = analyse_stability(campaign, tmp_path / "out", **settings, progress=SilentProgress(), simulations=few)
    assert outcome.requirement_met
    assert "keeps the customary margins" in outcome.verdict_lines[0]
    results = json.loads((tmp_path / "out" / "results.json").read_text())
    jsonschema.validate(results, json.loads((ROOT / "schemas" / "stability.schema.json").read_text()))
    assert results["joint"] == "el"
    smooth = [entry for entry in results["onsets"] if not entry["friction"]]
    assert smooth
    for entry in smooth:
        assert entry["found"] == pytest.approx(entry["predicted"], rel=0.01)
    assert 0.0 < results["worst_sigma"] < 1.0
    assert (tmp_path / "out" / "tables" / "stability" / "poles.parquet").is_file()
    page = outcome.report.read_text()
    assert "Onset by simulation" in page
    assert "Limit cycles" in page


def test_a_joint_that_is_not_there_is_told(tmp_path: Path) -> None:
    campaign = load_campaign(ROOT / "campaigns" / "EL089", checksums=False)
    with pytest.raises(ConfigError, match="there is no joint 'elevation'"):
        analyse_stability(
            campaign,
            tmp_path / "out",
            joint="elevation",
            low_deg=0.0,
            high_deg=80.0,
            points=2,
            progress=SilentProgress(),
        )
    assert not (tmp_path / "out").exists()
