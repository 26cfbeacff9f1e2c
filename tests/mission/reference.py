"""The archived reference day's mission, and variants of it."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from pathlib import Path

from kbs_process.campaign.load import load_campaign
from kbs_process.campaign.mission import Day, load_day
from kbs_process.mission.model import Mission, Orbit

FOLDER = Path(__file__).parents[2] / "campaigns" / "REFDAY"
DAY: Day = load_day(load_campaign(FOLDER, recordings=False))
MISSION: Mission = DAY.mission
ORBIT: Orbit = MISSION.orbit


def later(hours: float) -> Mission:
    """Return the mission begun `hours` later: another longitude of the node, other passes."""
    return replace(MISSION, orbit=replace(ORBIT, epoch=ORBIT.epoch + timedelta(hours=hours)))
