"""Which folder `campaign/NAME` is, and where results go."""

from __future__ import annotations

from pathlib import Path

import pytest

from campaign.campaign_folder import CampaignFolder
from kbs_process.campaign.locate import find_campaign, results_folder
from kbs_process.errors import ConfigError, OutputError


@pytest.fixture
def root(folder: CampaignFolder) -> Path:
    """A project with one campaign, EL089."""
    return folder.path.parents[1]


@pytest.mark.parametrize("place", [".", "campaigns", "campaigns/EL089", "campaigns/EL089/parameters"])
@pytest.mark.parametrize("name", ["campaign/EL089", "campaigns/EL089"])
def test_a_name_is_found_here_and_above(root: Path, monkeypatch: pytest.MonkeyPatch, place: str, name: str) -> None:
    monkeypatch.chdir(root / place)
    assert find_campaign(name) == root / "campaigns" / "EL089"


def test_a_path_goes_as_well(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(root / "campaigns" / "EL089")
    assert find_campaign(".") == root / "campaigns" / "EL089"
    assert find_campaign(str(root / "campaigns" / "EL089" / "campaign.toml")) == root / "campaigns" / "EL089"


def test_a_wrong_name_is_answered_with_a_right_one(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(root)
    with pytest.raises(ConfigError, match="did you mean 'campaign/EL089'"):
        find_campaign("campaign/EL098")
    with pytest.raises(ConfigError, match="known: campaign/EL089"):
        find_campaign("campaign/somethingelse")
    with pytest.raises(ConfigError, match="known: campaign/EL089"):  # what it is in, is no likeness
        find_campaign("campaign/nofile")


def test_results_go_beside_the_campaigns(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    campaign = root / "campaigns" / "EL089"
    assert results_folder(campaign, None) == root / "results" / "EL089"
    assert results_folder(campaign, None, "-predicted") == root / "results" / "EL089-predicted"
    assert results_folder(campaign, Path("out")) == tmp_path / "out"
    assert results_folder(tmp_path / "elsewhere" / "X", None) == tmp_path / "results" / "X"


@pytest.mark.parametrize("output", [".", "results", "..", "../.."])
def test_results_never_go_into_the_campaign_nor_over_it(root: Path, output: str) -> None:
    campaign = root / "campaigns" / "EL089"
    with pytest.raises(OutputError, match="campaign's folder"):
        results_folder(campaign, campaign / output)
