"""What loading makes of a good campaign."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from math import pi
from pathlib import Path

import numpy as np
import pytest

from campaign.campaign_folder import CampaignFolder
from kbs_process.campaign.load import load_campaign
from kbs_process.results import provenance


def test_example_becomes_a_rig_in_si(folder: CampaignFolder) -> None:
    campaign = load_campaign(folder.path)
    rig = campaign.rig
    assert rig.joint_names == ("az", "el")
    assert rig.joint("el").axis == (0.0, -1.0, 0.0)
    assert float(rig.gravity) == 9.80665
    quantities = rig.quantities()
    # 1.5 mrad, one number for both elements.
    np.testing.assert_allclose(quantities["transducer.tilt"].sigma, [1.5e-3, 1.5e-3], rtol=1e-15)
    assert quantities["transducer.tilt"].unit == "rad"
    assert float(quantities["joint.el.drive.Ka"]) == 1e4
    assert quantities["joint.el.drive.Ka"].source == "identification, configuration 1"
    np.testing.assert_array_equal(quantities["body.antenna.cog"].value, [0.07, 0.06, -0.02])
    assert quantities["transducer.cross_coupling"].shape == (6, 6)
    assert quantities["transducer.cross_coupling"].value[0, 4] == 0.05
    assert rig.spacecraft is not None
    assert rig.transducer.amplifier is not None
    assert rig.transducer.amplifier.order == 2


def test_every_number_of_the_files_reaches_the_rig(folder: CampaignFolder) -> None:
    text = "".join((folder.path / "parameters" / name).read_text() for name in ("rig.toml", "drives.toml"))
    quantities = load_campaign(folder.path).rig.quantities()
    assert len(quantities) == text.count("source =")
    assert all(quantity.source for quantity in quantities.values())


def test_description_of_recordings_and_requirement(folder: CampaignFolder) -> None:
    campaign = load_campaign(folder.path)
    assert [entry.name for entry in campaign.with_role("held-out")] == ["EL089P00_2", "EL089P00_3"]
    assert campaign.recording("EL089P00_3").repeat == 3
    (requirement,) = campaign.requirements
    assert (requirement.limit, requirement.unit, requirement.band) == (0.06, "N m", (0.01, 1.0))
    assert campaign.bands.low_pass == (1.0, 2.0)
    assert campaign.topics.wrench.fields[3] == "wrench.torque.x"
    assert campaign.topics.angle is not None
    assert campaign.topics.angle.fields == ("position[az]", "position[el]")
    assert campaign.topics.command is not None
    assert campaign.topics.command.channels == ("az", "el", "az.rate", "el.rate")
    assert campaign.topics.temperature is None


def test_units_of_a_limit_are_converted(folder: CampaignFolder) -> None:
    folder.replace("campaign.toml", '{ value = 0.06, unit = "N m" }', '{ value = 60, unit = "N mm" }')
    assert load_campaign(folder.path).requirements[0].limit == pytest.approx(0.06, rel=1e-15)


def test_rates_and_lists_of_units_are_converted(folder: CampaignFolder) -> None:
    folder.replace(
        "parameters/rig.toml",
        'bias = { value = [0, 0, 0, 0, 0, 0], unit = ["N", "N", "N", "N m", "N m", "N m"]',
        'bias = { value = [1, 2, 3, 4, 5, 6], unit = ["kN", "N", "mN", "N m", "N mm", "kN m"]',
    )
    folder.replace(
        "parameters/drives.toml", 'w_dyn = { value = 0.05, unit = "rad/s"', 'w_dyn = { value = 3, unit = "rpm"'
    )
    quantities = load_campaign(folder.path).rig.quantities()
    np.testing.assert_allclose(quantities["transducer.bias"].value, [1000, 2, 3e-3, 4, 5e-3, 6000], rtol=1e-15)
    np.testing.assert_allclose(quantities["transducer.bias"].sigma, [5000, 5, 5e-3, 0.5, 0.5e-3, 500], rtol=1e-15)
    assert float(quantities["joint.az.drive.w_dyn"]) == pytest.approx(0.1 * pi, rel=1e-15)


def test_fields_of_a_topic_can_be_named(folder: CampaignFolder) -> None:
    folder.replace(
        "campaign.toml",
        'encoder = "/encoder"',
        'encoder = { topic = "/bench/angles", fields = ["azimuth.value", "elevation.value"] }',
    )
    angle = load_campaign(folder.path).topics.angle
    assert angle is not None
    assert (angle.key, angle.topic, angle.fields) == ("angle", "/bench/angles", ("azimuth.value", "elevation.value"))


def test_matrix_from_a_csv_file(folder: CampaignFolder) -> None:
    matrix = np.arange(36.0).reshape(6, 6) / 1000.0
    np.savetxt(folder.path / "X.csv", matrix, delimiter=",")
    text = (folder.path / "parameters/rig.toml").read_text()
    first = text.index("value = [\n")
    last = text.index("]\nunit", first) + 1
    (folder.path / "parameters/rig.toml").write_text(text[:first] + 'value = "X.csv"' + text[last:])
    campaign = load_campaign(folder.path)
    np.testing.assert_array_equal(campaign.rig.transducer.cross_coupling.value, matrix)
    assert folder.path / "X.csv" in campaign.inputs


MOTION = """
schema = 1
name = "WHEEL"
title = "Instrumented wheel"
drive = "motion"
[bands]
high_pass_Hz = 0.0
low_pass_Hz = [6.0]
working_rate_Hz = 60.0
[topics]
wrench = "/wheel/wrench"
rate = "/wheel/speed"
[parameters]
files = ["rig.toml"]
[[recording]]
file = "baseline.mcap"
trajectory = "baseline"
role = "fit"
"""

WHEEL = """
[gravity]
magnitude = { value = 9.80665, unit = "m/s^2", sigma = 0.0, source = "standard" }
[transducer]
on = "wheel"
channels = ["Fx", "Fy", "Tz"]
tilt = { value = 0.0, unit = "deg", sigma = 1.0, source = "by eye" }
cross_coupling = { value = 0.0, unit = "SI by channel pair", sigma = 0.0, source = "decoupled by the maker" }
bias = { value = [1.0, 2.0, 0.3], unit = "SI by channel", sigma = [1.0, 1.0, 0.1], source = "guess" }
noise = { value = [0.5, 0.5, 0.05], unit = ["N", "N", "N m"], sigma = 0.0, source = "still recording" }
resolution = { value = 0.0, unit = "SI by channel", sigma = 0.0, source = "unknown" }
[body.pushrim]
on = "T"
mass = { value = 0.6, unit = "kg", sigma = 0.3, source = "guess" }
cog = { value = 0.0, unit = "m", sigma = 0.05, source = "symmetry" }
inertia = { value = [0.02, 0.02, 0.04, 0, 0, 0], unit = "kg m^2", sigma = 0.01, source = "ring" }
[joint.wheel]
parent = "lab"
axis = [0, 2, 0]
origin = { value = 0.0, unit = "m", sigma = 0.0, source = "definition" }
misalignment = { value = 0.0, unit = "deg", sigma = 3.0, source = "camber unknown" }
"""


def test_a_wheel_that_carries_its_transducer(tmp_path: Path) -> None:
    """One joint, three channels, no drive, no controller, no encoder, no spacecraft, a rigid transducer."""
    (tmp_path / "campaign.toml").write_text(MOTION)
    (tmp_path / "rig.toml").write_text(WHEEL)
    (tmp_path / "baseline.mcap").touch()
    campaign = load_campaign(tmp_path)
    rig = campaign.rig
    assert (rig.controller, rig.spacecraft, rig.transducer.stiffness, rig.joints[0].drive) == (None,) * 4
    assert rig.joints[0].axis == (0.0, 1.0, 0.0)
    np.testing.assert_array_equal(rig.transducer.bias.value, [1.0, 2.0, 0, 0, 0, 0.3])
    np.testing.assert_array_equal(rig.transducer.noise.value, [0.5, 0.5, 0, 0, 0, 0.05])
    assert campaign.topics.wrench.fields == ("wrench.force.x", "wrench.force.y", "wrench.torque.z")
    assert campaign.topics.rate is not None
    assert campaign.topics.rate.fields == ("velocity[wheel]",)
    assert campaign.effects == ()


def test_joints_are_ordered_from_the_laboratory(folder: CampaignFolder) -> None:
    text = (folder.path / "parameters/rig.toml").read_text()
    az, el = text.index("[joint.az]"), text.index("[joint.el]")
    (folder.path / "parameters/rig.toml").write_text(text[:az] + text[el:] + "\n" + text[az:el])
    assert load_campaign(folder.path).rig.joint_names == ("az", "el")


def test_effects_come_in_the_order_of_the_catalogue(folder: CampaignFolder) -> None:
    before = load_campaign(folder.path).effects
    folder.replace("campaign.toml", '    "synchronous_motor",\n', "")
    folder.replace("campaign.toml", '    "flexspline",\n', '    "flexspline",\n    "synchronous_motor",\n')
    assert load_campaign(folder.path).effects == before


def test_a_right_checksum_passes(folder: CampaignFolder) -> None:
    recording = folder.path / "recordings" / "EL089P00_1.mcap"
    recording.write_bytes(b"recorded")
    digest = hashlib.sha256(b"recorded").hexdigest()
    folder.replace("campaign.toml", 'role = "fit"', f'role = "fit"\nsha256 = "{digest}"')
    assert load_campaign(folder.path).recording("EL089P00_1").sha256 == digest


def test_provenance_names_every_input_and_stays_the_same(folder: CampaignFolder) -> None:
    campaign = load_campaign(folder.path)
    by_file = provenance.checksums(campaign.folder, campaign.files)
    assert set(by_file) == {
        "campaign.toml",
        "parameters/rig.toml",
        "parameters/drives.toml",
        *(f"recordings/{entry.name}.mcap" for entry in campaign.recordings),
    }
    text = (folder.path / "campaign.toml").read_bytes()
    assert by_file["campaign.toml"] == hashlib.sha256(text).hexdigest()
    one, two = (json.dumps([provenance.software(), provenance.parameters(campaign.rig)]) for _ in range(2))
    assert one == two


LOADING = """
import sys
from pathlib import Path
from kbs_process.campaign.load import load_campaign
load_campaign(Path(sys.argv[1]), checksums=False)
print(*sys.modules)
"""


def test_loading_imports_nothing_that_it_has_no_use_for(folder: CampaignFolder) -> None:
    command = [sys.executable, "-c", LOADING, str(folder.path)]
    modules = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    for name in ("kbs_process.diagnosis", "kbs_process.studies", "kbs_process.report", "matplotlib", "jsonschema"):
        assert not any(module == name or module.startswith(f"{name}.") for module in modules), name


def test_an_effect_may_act_twice(folder: CampaignFolder) -> None:
    folder.replace("campaign.toml", '"cogging",', '"motor_order_2", "cogging", "motor_order",')
    numbers = "".join(
        f'{name} = {{ value = {value}, unit = "{unit}", sigma = 0.0, source = "found" }}\n'
        for tag in ("", "_2")
        for name, value, unit in (
            (f"order_sin{tag}", 0.001, "N m"),
            (f"order_cos{tag}", 0.0, "N m"),
            (f"order{tag}", 7.0 if tag else 12.0, "1"),
        )
    )
    for joint in ("az", "el"):
        heading = f"[joint.{joint}.drive.parameters]\n"
        folder.replace("parameters/drives.toml", heading, heading + numbers)
    campaign = load_campaign(folder.path)
    assert campaign.effects[-2:] == ("motor_order", "motor_order_2")
    assert float(campaign.rig.quantities()["joint.el.drive.order_2"]) == 7.0
