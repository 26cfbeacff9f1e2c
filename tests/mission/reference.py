"""The archived reference day's mission, and variants of it."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from functools import cache

from archived import CAMPAIGNS, campaign
from kbs_process.campaign.mission import Day, load_day
from kbs_process.mission.model import Mission, Orbit

FOLDER = CAMPAIGNS / "REFDAY"


@cache
def day() -> Day:
    """The archived day."""
    return load_day(campaign("REFDAY", recordings=False))


def mission() -> Mission:
    """Its mission."""
    return day().mission


def orbit() -> Orbit:
    """The orbit of its spacecraft."""
    return mission().orbit


def later(hours: float) -> Mission:
    """Return the mission begun `hours` later: another longitude of the node, other passes."""
    return replace(mission(), orbit=replace(orbit(), epoch=orbit().epoch + timedelta(hours=hours)))
