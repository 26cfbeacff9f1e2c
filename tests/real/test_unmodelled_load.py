"""A bungee that no parameter file describes, in an archived campaign: told at the top of the report, by its factor."""

from __future__ import annotations

import shutil

import pytest

from engine.campaigns import CAMPAIGNS_FOLDER
from kbs_process.campaign.load import load_campaign
from kbs_process.progress import SilentProgress
from kbs_process.studies.correlate import run
from real.campaigns import Processed

pytestmark = pytest.mark.slow


def _warnings(name, folder):
    run.process(load_campaign(CAMPAIGNS_FOLDER / name), folder / name, progress=SilentProgress(), page=False)
    found = Processed(CAMPAIGNS_FOLDER / name, folder / name).results.warnings
    shutil.rmtree(folder / name)
    return [notice for notice in found if "unmodelled static load" in notice.what]


def test_recordings_with_a_bungee_are_named_with_channels_and_a_remedy(tmp_path):
    told = _warnings("AL012M00", tmp_path)
    assert [notice.where for notice in told] == ["AL012M00_1", "AL012M00_2"]
    assert {notice.severity for notice in told} == {"warning"}
    for notice in told:
        assert "Tx" in notice.what
        assert "Ty" in notice.what
        assert "The verdict is about that load" in notice.what
        assert "bungee" in notice.remedy


def test_recordings_that_gravity_describes_are_not(tmp_path):
    assert _warnings("EL089", tmp_path) == []
