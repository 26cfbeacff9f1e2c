"""What a campaign's bands and its way of driving the plant make of the stages' settings."""

from __future__ import annotations

from kbs_process.campaign.config import Campaign
from kbs_process.stages.gravity.model import GravitySettings
from kbs_process.stages.motion import MotionSettings

_FLANK = 2.0  # times a band's upper edge: what a band filter leaves beyond is below 1e-2
_HALF = 1.5  # times its corner, the gravity fit's low-pass has a gain of one half, as a band has at its edge


def motion_settings(campaign: Campaign) -> MotionSettings:
    """Angles of a plant that commands drive serve gravity, in the bands; those that drive it themselves are
    the prediction, and must be whole as far as the widest band's flank reaches."""
    widest = max(campaign.bands.low_pass)
    return MotionSettings(band_Hz=_FLANK * widest if campaign.drive == "motion" else widest)


def gravity_settings(campaign: Campaign) -> GravitySettings:
    """A rig that is driven by its motion has inertia and response fitted too, in the narrowest band.

    Every other band contains that one, and of what a rigid body does not explain it holds least. Recordings are tared
    in the widest, in which loads that come and go can be told apart best.
    """
    taring = max(campaign.bands.low_pass)
    if campaign.drive == "command":
        return GravitySettings(taring_Hz=taring)
    return GravitySettings(low_pass_Hz=min(campaign.bands.low_pass) / _HALF, taring_Hz=taring, response=True)
