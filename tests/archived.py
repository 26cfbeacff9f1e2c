"""The archived campaigns, each read once by a process: what comes of it is frozen, so that tests may share it."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from _pytest.mark import ParameterSet

    from kbs_process.campaign.config import Campaign
    from kbs_process.rig.model import Rig

CAMPAIGNS = Path(__file__).parents[1] / "campaigns"
FIRST = ("AESING00", "AZPS_ATA", "EL089", "EL089_FM")  # what is tested of each is tested of these by every run


def each(names: Iterable[str]) -> list[ParameterSet]:
    """A test's parameters: campaigns by name, with how fast their tests are."""
    import pytest

    marks = {True: pytest.mark.slow, False: pytest.mark.validation}
    return [pytest.param(name, marks=marks[name in FIRST]) for name in names]


@cache
def campaign(name: str, *, flight: bool = False, recordings: bool = True) -> Campaign:
    """The campaign as loaded, its recordings not read through."""
    from kbs_process.campaign.load import load_campaign

    return load_campaign(CAMPAIGNS / name, checksums=False, flight=flight, recordings=recordings)


def rig(name: str = "EL089") -> Rig:
    """The campaign's rig."""
    return campaign(name, recordings=False).rig
