"""What the laboratory does to a rig, in a campaign's files: read, checked, and left behind in flight."""

from __future__ import annotations

import pytest

from campaign.campaign_folder import CampaignFolder
from kbs_process.campaign.load import load_campaign

RIG = "parameters/rig.toml"
CORD = """
[external.bungee]
on = "el"
point = { value = [70, 60, -20], unit = "mm", sigma = 0.5, source = "drawing" }

[external.bungee.parameters]
stiffness = { value = 60.0, unit = "N/m", sigma = 0.15, source = "pull test" }
free_length = { value = 712, unit = "mm", sigma = 3, source = "load cell" }
anchor_x = { value = 0.07, unit = "m", sigma = 2e-3, source = "theodolite" }
anchor_y = { value = 0.06, unit = "m", sigma = 2e-3, source = "theodolite" }
anchor_z = { value = 3.2, unit = "m", sigma = 2e-3, source = "theodolite" }
"""


def hang(folder: CampaignFolder, cord: str = CORD) -> CampaignFolder:
    """Put the example on a cord that its calibration did not have."""
    folder.append(RIG, cord)
    folder.replace("campaign.toml", '"flexspline",', '"flexspline",\n    "bungee",')
    folder.replace("campaign.toml", 'role = "calibration"', 'role = "calibration"\nwithout = ["bungee"]')
    return folder


def test_a_cord_is_read_in_si(folder: CampaignFolder) -> None:
    campaign = load_campaign(hang(folder).path)
    quantities = campaign.rig.quantities()
    assert quantities["external.bungee.point"].value.tolist() == [0.07, 0.06, -0.02]
    assert float(quantities["external.bungee.free_length"]) == 0.712
    assert float(quantities["external.bungee.stiffness"].sigma) == 0.15
    calibration, slew, *_ = campaign.recordings
    assert "bungee" in campaign.acting(slew)
    assert "bungee" not in campaign.acting(calibration)


def test_it_does_not_fly(folder: CampaignFolder) -> None:
    flown = load_campaign(hang(folder).path, flight=True)
    assert "bungee" not in flown.effects
    assert not flown.rig.external


MOUNTING = """
[external.base_hysteresis]
on = "T"

[external.base_hysteresis.parameters]
base_loop_x = { value = 20, unit = "mN m", sigma = 1, source = "diagnosis" }
base_loop_y = { value = 0.0, unit = "N m", sigma = 0, source = "diagnosis" }
base_loop_z = { value = 0.0, unit = "N m", sigma = 0, source = "diagnosis" }
base_slip_angle = { value = 20, unit = "urad", sigma = 1, source = "diagnosis" }
base_slip_power = { value = 1.5, unit = "1", sigma = 0, source = "diagnosis" }
"""


def test_a_mounting_is_read_and_asks_for_a_plate_that_turns(folder: CampaignFolder) -> None:
    folder.append(RIG, MOUNTING)
    folder.replace("campaign.toml", '"flexspline",', '"flexspline",\n    "base_hysteresis",')
    campaign = load_campaign(folder.path)
    (mounting,) = campaign.rig.external
    assert (mounting.on, mounting.point) == ("T", None)
    assert float(mounting.parameters["base_loop_x"]) == 0.02
    assert "base_hysteresis" not in load_campaign(folder.path, flight=True).effects
    for key in ("stiffness", "damping"):
        folder.replace(RIG, f"\n{key} =", f"\n# {key} =")
    assert "acts on the angles of a plate that turns" in str(folder.refusal())


FAULTS = {
    "no table": (CORD, "", ["external.bungee", "is missing, although"]),
    "unknown effect": ("external.bungee", "external.bunge", ["external.bunge", "did you mean 'bungee'"]),
    "unknown link": ('on = "el"', 'on = "eel"', ["external.bungee.on", "did you mean 'el'"]),
    "on the laboratory": ('on = "el"', 'on = "lab"', ["nothing would feel the force"]),
    "no point": ("point =", "# ", ["external.bungee.point", "is missing"]),
    "parameter missing": ("stiffness = { value = 60.0", "# ", ["external.bungee.parameters.stiffness", "N/m"]),
    "parameter unknown": ("free_length", "freelength", ["did you mean 'free_length'"]),
    "out of bounds": ("value = 60.0", "value = -60.0", ["stiffness", "out of bounds"]),
    "wrong unit": ('unit = "N/m"', 'unit = "N"', ["stiffness", "'N'"]),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_fault_is_refused(folder: CampaignFolder, fault: str) -> None:
    old, new, words = FAULTS[fault]
    assert old in CORD
    message = str(hang(folder, CORD.replace(old, new)).refusal())
    for word in words:
        assert word in message


def test_only_effects_of_the_model_can_be_absent(folder: CampaignFolder) -> None:
    hang(folder).replace("campaign.toml", 'without = ["bungee"]', 'without = ["bunge"]')
    assert "did you mean 'bungee'" in str(folder.refusal())
