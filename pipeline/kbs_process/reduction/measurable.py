"""Can what is recorded tell of what is required? Asked before recordings are read, and by `validate`."""

from __future__ import annotations

from kbs_process.campaign.config import Campaign, Requirement
from kbs_process.errors import ConfigError
from kbs_process.rig.model import Rig
from kbs_process.signals.records import WRENCH_CHANNELS


def check_requirements(campaign: Campaign) -> None:
    """Raise ConfigError for the first requirement of which nothing is measured."""
    for requirement in campaign.requirements:
        judged_channels(requirement, campaign.rig)


def judged_channels(requirement: Requirement, rig: Rig) -> tuple[str, ...]:
    """Return the channels by which a requirement is judged; raise ConfigError where there are none.

    A torque about another point needs the force: at the spacecraft there are all six channels, or none.
    """
    measured = {rig.frame: rig.channels}
    if rig.spacecraft is not None and set(WRENCH_CHANNELS) <= set(rig.channels):
        measured["S"] = WRENCH_CHANNELS
    if requirement.frame not in measured:
        raise ConfigError(
            f"nothing was measured in frame {requirement.frame}: recorded are {', '.join(rig.channels)}",
            where=requirement.name,
            remedy="give [spacecraft] in the parameter files and all six channels, or frame = 'T'",
        )
    prefix = "T" if requirement.quantity == "torque" else "F"
    channels = tuple(name for name in measured[requirement.frame] if name.startswith(prefix))
    if not channels:
        raise ConfigError(
            f"no {requirement.quantity} was measured in frame {requirement.frame}",
            where=requirement.name,
            remedy=f"state a requirement on what is: {', '.join(measured[requirement.frame])}",
        )
    return channels
