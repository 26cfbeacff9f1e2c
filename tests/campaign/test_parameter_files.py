"""Corrected parameter files load at once, and differ in what was identified alone."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np

from kbs_process.campaign.load import load_campaign
from kbs_process.campaign.writing.parameter_files import corrected, write_parameters

DUMMY1 = Path(__file__).parents[2] / "campaigns" / "DUMMY1"


def test_round_trip(tmp_path: Path) -> None:
    campaign = load_campaign(DUMMY1, checksums=False)
    known = campaign.rig.quantities()
    names = ("joint.el.drive.Ka", "transducer.stiffness", "body.antenna.inertia", "transducer.amplifier.corner")
    changed = {
        name: replace(
            known[name], value=known[name].value * 1.01, sigma=known[name].sigma / 3.0, source='identified from "A"'
        )
        for name in names
    }
    folder = tmp_path / "DUMMY1"
    shutil.copytree(DUMMY1, folder)
    shutil.rmtree(folder / "parameters")
    write_parameters(folder / "parameters", corrected(campaign, changed, "A"))
    again = load_campaign(folder, checksums=False).rig.quantities()
    assert set(again) == set(known)
    for name, quantity in again.items():
        expected = changed.get(name, known[name])
        np.testing.assert_allclose(quantity.value, expected.value, rtol=1e-14, err_msg=name)
        np.testing.assert_allclose(quantity.sigma, expected.sigma, rtol=1e-14, err_msg=name)
        assert (quantity.source, quantity.unit) == (expected.source, expected.unit)
