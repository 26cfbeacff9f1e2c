"""A limit on pointing in a campaign: met by its recordings, and not known of what the campaign cuts off."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from campaign.campaign_folder import CampaignFolder
from kbs_process.campaign.load import load_campaign
from kbs_process.progress import SilentProgress
from kbs_process.studies.correlate.run import process

pytestmark = pytest.mark.slow

LIMIT = """
[[pointing]]
name = "Bias"
statistic = "bias"
limit = { value = 0.2, unit = "deg" }
source = "a test"

[bands]
"""


@pytest.mark.parametrize(("cut", "verdict", "doubt"), [("", "pass", ""), ("end_s = 17.0\n", "undecided", "cut off")])
def test_a_limit_on_pointing(folder: CampaignFolder, tmp_path: Path, cut: str, verdict: str, doubt: str) -> None:
    description = folder.path / "campaign.toml"
    text = description.read_text().replace("\n[bands]\n", LIMIT)
    description.write_text(text.replace('role = "held-out"\n', f'role = "held-out"\n{cut}'))
    process(load_campaign(folder.path, checksums=False), tmp_path / "out", progress=SilentProgress(), page=False)
    (one,) = json.loads((tmp_path / "out" / "results.json").read_text())["judged_pointing"]
    assert (one["verdict"], doubt in one["doubt"]) == (verdict, True)
    assert one["where"].endswith(", by encoder")
    assert one["predicted"] > 0.0
