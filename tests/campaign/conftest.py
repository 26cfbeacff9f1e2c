from pathlib import Path

import pytest

from campaign.campaign_folder import CampaignFolder, make_folder


@pytest.fixture
def folder(tmp_path: Path) -> CampaignFolder:
    """A campaign folder that may be damaged."""
    return make_folder(tmp_path / "campaigns" / "EL089")
