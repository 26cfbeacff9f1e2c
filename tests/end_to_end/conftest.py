from pathlib import Path

import pytest

from campaign.campaign_folder import CampaignFolder
from end_to_end.short_campaign import short_campaign


@pytest.fixture
def folder(tmp_path: Path) -> CampaignFolder:
    """A campaign that may be damaged."""
    return short_campaign(tmp_path / "campaigns" / "EL089")
