"""A corrected model loads at once, with what was left out in its plant."""

from __future__ import annotations

from pathlib import Path

from kbs_process.campaign.corrected_model import write_model
from kbs_process.campaign.load import load_campaign
from kbs_process.plant.attach import attach
from kbs_process.plant.effects import select

CAMPAIGN = Path(__file__).parents[2] / "campaigns" / "EL089"


def test_it_loads_with_the_effect_that_was_found(tmp_path: Path) -> None:
    campaign = load_campaign(CAMPAIGN, checksums=False)
    (harness,) = select(["harness"])
    amplitudes = {entry.name: 0.5 for entry in harness.parameters if entry.role == "amplitude"}
    rig = attach(campaign.rig, harness, amplitudes, joints=["el"])
    changed = {name: entry for name, entry in rig.quantities().items() if entry.value.ndim > 1}
    write_model(campaign, rig, (*campaign.effects, "harness"), changed, tmp_path, "by a test")
    corrected = load_campaign(tmp_path, checksums=False)
    assert set(corrected.effects) == {*campaign.effects, "harness"}
    assert [entry.path.resolve() for entry in corrected.recordings] == [
        entry.path.resolve() for entry in campaign.recordings
    ]
    found, before = corrected.rig.quantities(), rig.quantities()
    assert set(found) == set(before)
    for name in found:
        assert found[name].value.tolist() == before[name].value.tolist(), name
