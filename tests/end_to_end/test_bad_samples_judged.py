"""A single bad sample in a campaign: named, interpolated, and what is judged is told with and without it."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from campaign.campaign_folder import CampaignFolder
from end_to_end.damage import alter, with_last_number
from end_to_end.short_campaign import record
from kbs_process.campaign.load import load_campaign
from kbs_process.progress import SilentProgress
from kbs_process.studies.correlate.run import process

pytestmark = pytest.mark.slow


def results_of(folder: CampaignFolder, target: Path) -> dict:
    process(load_campaign(folder.path, checksums=False), target, progress=SilentProgress(), page=False)
    found: dict = json.loads((target / "results.json").read_text())
    return found


def test_the_figure_with_and_without_a_bad_sample_is_told(folder: CampaignFolder, tmp_path: Path) -> None:
    rig = load_campaign(folder.path, checksums=False).rig
    for number, path in enumerate(sorted((folder.path / "recordings").iterdir())):
        record(path, noise=0.002, seed=number, rig=rig)
    clean = results_of(folder, tmp_path / "clean")
    path = folder.path / "recordings" / "EL089P00_2.mcap"
    alter(path, "/transducer/wrench", lambda t, payload: with_last_number(payload, 90.0) if t == 11.0 else payload)
    found = results_of(folder, tmp_path / "bad")
    (told,) = [one for one in found["warnings"] if "do not bear out" in one["what"]]
    assert told["severity"] == "warning" and told["where"] == "EL089P00_2"
    assert "1 in Tz at 11.0000 s, off by 90" in told["what"]
    assert [one["value"] for one in found["requirements"]] == pytest.approx(
        [one["value"] for one in clean["requirements"]], rel=1e-2
    )
    figures = re.findall(r"([\d.]+) N m without them, ([\d.]+) N m with them \((\w+)", told["what"])
    assert len(figures) == len(found["requirements"]) > 0
    assert any(float(kept) > 10.0 * float(without) for without, kept, _ in figures)
