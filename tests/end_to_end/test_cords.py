"""Configurations 3 and 4: what a cord that the model knows leaves of a recording, and what it does for pointing."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from end_to_end.archive_run import Processed

pytestmark = pytest.mark.validation


def torques(campaign: Processed, recording: str) -> dict[str, float]:
    """Measured rms of each torque at the transducer, 0.01 to 1 Hz."""
    return {
        one["channel"]: one["measured_rms"]
        for one in campaign.results["merit"]
        if (one["recording"], one["band"], one["frame"]) == (recording, "lt1Hz", "T") and one["channel"].startswith("T")
    }


def test_a_known_cord_is_taken_off_to_within_its_uncertainty(archived: Callable[[str], Processed]) -> None:
    """AL012M00 hangs on a cord of its own that no file knows; AL012_CORD on one whose numbers are known."""
    unknown = torques(archived("AL012M00"), "AL012M00_2")
    campaign = archived("AL012_CORD")
    known = torques(campaign, "AL012M00_2")
    budget = {
        one["channel"]: one["total"]
        for one in campaign.results["budget"]
        if (one["recording"], one["band"], one["frame"]) == ("AL012M00_2", "lt1Hz", "T")
    }
    print("unknown, known, its sigma:", [(c, unknown[c], known[c], budget[c]) for c in known])
    assert unknown["Tx"] > 0.3
    assert unknown["Ty"] > 0.3
    for channel, left in known.items():
        assert left < 0.1 * max(unknown.values())
        assert left < 2.5 * budget[channel]


def test_a_cord_takes_the_windup_out_of_pointing(archived: Callable[[str], Processed]) -> None:
    """Open loop, to 70 to 87 deg: gravity winds the gear up by 0.6 mrad, and by a tenth of it on the cord."""
    bias = {
        name: next(
            one["estimate"]["bias"]
            for one in archived(name).results["pointing"]
            if one["recording"] == "EL089P00_1" and one["estimate"]["axis"] == "el"
        )
        for name in ("EL089", "EL089_CORD")
    }
    print("elevation's bias, rad:", bias)
    assert abs(bias["EL089"]) > 4e-4
    assert abs(bias["EL089_CORD"]) < 2e-4
