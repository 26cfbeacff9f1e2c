"""Every fault of a campaign is refused with file, line, key and remedy."""

# ruff: noqa: E501  (a table reads best with a fault a line)

from __future__ import annotations

import hashlib
import os

import pytest

from campaign.campaign_folder import CampaignFolder
from kbs_process.campaign.load import load_campaign
from kbs_process.errors import ConfigError

RIG, DRIVES, CAMPAIGN = "parameters/rig.toml", "parameters/drives.toml", "campaign.toml"

# file, text, what it becomes, and what the message has to say besides file and line
FAULTS = {
    "unknown key": (CAMPAIGN, "high_pass_Hz =", "highpass_Hz =", ["bands.highpass_Hz", "did you mean 'high_pass_Hz'"]),
    "unknown table": (CAMPAIGN, "[model]", "[modell]", ["modell", "did you mean 'model'"]),
    "unknown role": (CAMPAIGN, 'role = "held-out"', 'role = "heldout"', ["recording[3].role", "did you mean 'held-out'"]),
    "unknown drive": (CAMPAIGN, 'drive = "command"', 'drive = "comand"', ["drive", "did you mean 'command'"]),
    "text for a number": (CAMPAIGN, "high_pass_Hz = 0.01", 'high_pass_Hz = "0.01"', ["is a text, not a number"]),
    "number for a text": (CAMPAIGN, 'trajectory = "AZPS_ATA"', "trajectory = 3", ["recording[1].trajectory"]),
    "unknown effect": (CAMPAIGN, '"cogging"', '"coging"', ["model.effects[2]", "did you mean 'cogging'"]),
    "NaN": (CAMPAIGN, "working_rate_Hz = 20.0", "working_rate_Hz = nan", ["bands.working_rate_Hz", "not a finite"]),
    "version": (CAMPAIGN, "schema = 1", "schema = 7", ["is 7, not 1"]),
    "limit in another dimension": (
        CAMPAIGN,
        'limit = { value = 0.06, unit = "N m" }',
        'limit = { value = 0.06, unit = "N" }',
        ["requirement[1].limit.unit", "unit of force", "torque (N m) is expected", "'N mm'"],
    ),
    "band beyond the bands": (CAMPAIGN, "band_Hz = [0.01, 1.0]", "band_Hz = [0.01, 5.0]", ["beyond", "0.01 to 2 Hz"]),
    "empty band": (CAMPAIGN, "band_Hz = [0.01, 1.0]", "band_Hz = [1.0, 0.01]", ["is empty"]),
    "lower edge that no band has": (
        CAMPAIGN,
        "band_Hz = [0.01, 1.0]",
        "band_Hz = [0.5, 1.0]",
        ["requirement[1].band_Hz", "[0.5, 1] is not cut", "0.01 to 1 Hz and 0.01 to 2 Hz"],
    ),
    "upper edge that no band has": (CAMPAIGN, "band_Hz = [0.01, 1.0]", "band_Hz = [0.01, 1.5]", ["is not cut"]),
    "rate too low": (CAMPAIGN, "working_rate_Hz = 20.0", "working_rate_Hz = 3.0", ["2 Hz is above 1.2 Hz"]),
    "band in the flank of the decimation": (CAMPAIGN, "[1.0, 2.0]", "[1.0, 9.5]", ["9.5 Hz is above 8 Hz"]),
    "repeat twice": (CAMPAIGN, "repeat = 3", "repeat = 2", ["run 2 of EL089P00 is 'EL089P00_2' already"]),
    "recording twice": (CAMPAIGN, "EL089P00_3.mcap", "EL089P00_2.mcap", ["called 'EL089P00_2' too"]),
    "missing recording": (
        CAMPAIGN,
        "recordings/EL089P00_1.mcap",
        "recordings/EL089P01_1.mcap",
        ["recording[2].file", "does not exist", "did you mean 'EL089P00_1.mcap'"],
    ),
    "wrong number of fields": (
        CAMPAIGN,
        'encoder = "/encoder"',
        'encoder = { topic = "/encoder", fields = ["position[az]"] }',
        ["topics.encoder.fields", "1 fields for 2 channels", "az, el"],
    ),
    "encoders that are the commands": (
        CAMPAIGN,
        'encoder = "/encoder"',
        'encoder = "/command"',
        ["topics.encoder", "nothing is measured"],
    ),
    "an encoder on no joint": (
        CAMPAIGN,
        'encoder = "/encoder"',
        'encoder = { topic = "/encoder", joints = ["ell"] }',
        ["topics.encoder.joints[1]", "no joint 'ell'", "did you mean 'el'"],
    ),
    "joints of another topic": (
        CAMPAIGN,
        'command = "/command"',
        'command = { topic = "/command", joints = ["el"] }',
        ["topics.command.joints"],
    ),
    "no commands": (CAMPAIGN, 'command = "/command"', "", ["needs commands", "motion"]),
    "one table for a list": (CAMPAIGN, "[[requirement]]", "[requirement]", ["requirement", "write [[requirement]]"]),
    "missing parameter file": (CAMPAIGN, "parameters/rig.toml", "parameters/rg.toml", ["does not exist"]),
    "no sigma": (RIG, 'unit = "kg", sigma = 0.05, source', 'unit = "kg", source', ["body.base.mass.sigma", "is missing"]),
    "no unit": (RIG, 'value = 8.0, unit = "kg",', "value = 8.0,", ["body.base.mass.unit", "is missing"]),
    "no source": (RIG, ', source = "standard gravity"', "", ["gravity.magnitude.source", "say where"]),
    "negative sigma": (RIG, "sigma = 0.05", "sigma = -0.05", ["body.base.mass.sigma", "less than 0"]),
    "infinite": (RIG, "value = 8.0", "value = inf", ["body.base.mass.value", "inf is not a finite"]),
    "NaN in an array": (RIG, "[0.07, 0.06, -0.02]", "[0.07, nan, -0.02]", ["body.antenna.cog.value[2]"]),
    "other dimension": (
        RIG,
        'cog = { value = [0.0, 0.0, 0.06], unit = "m"',
        'cog = { value = [0.0, 0.0, 0.06], unit = "kg"',
        ["body.base.cog.unit", "unit of mass", "length (m) is expected", "'mm'"],
    ),
    "misspelt unit": (DRIVES, 'unit = "N m"', 'unit = "Nm"', ["joint.az.drive.parameters.Tmax.unit", "did you mean 'N m'"]),
    "one unit for forces and torques": (
        RIG,
        'bias = { value = [0, 0, 0, 0, 0, 0], unit = ["N", "N", "N", "N m", "N m", "N m"]',
        'bias = { value = [0, 0, 0, 0, 0, 0], unit = "N"',
        ["transducer.bias.unit", "forces and torques alike"],
    ),
    "units swapped": (
        RIG,
        'unit = ["N", "N", "N", "N m", "N m", "N m"], sigma = [5',
        'unit = ["N m", "N m", "N m", "N", "N", "N"], sigma = [5',
        ["transducer.bias.unit", "unit of torque, where force (N) is expected"],
    ),
    "wrong shape": (RIG, "[4000, 4000, 6000]", "[4000, 6000]", ["transducer.stiffness.value", "array of 3"]),
    "negative mass": (RIG, "value = 8.0", "value = -8.0", ["body.base.mass.value", "out of bounds"]),
    "impossible inertia": (RIG, "[0.7, 0.9, 0.8, 0.0", "[0.7, 0.9, 0.8, 2.0", ["body.antenna.inertia", "no body"]),
    "unknown link": (RIG, 'on = "el"', 'on = "ell"', ["body.antenna.on", "no link", "did you mean 'el'"]),
    "unknown parent": (RIG, 'parent = "az"', 'parent = "ax"', ["joint.el.parent", "no other link", "known: T, az, lab"]),
    "branching chain": (RIG, 'parent = "az"', 'parent = "T"', ["joint.el.parent", "one chain"]),
    "loop": (RIG, 'parent = "T"', 'parent = "el"', ["not connected to the laboratory"]),
    "axis without direction": (RIG, "axis = [0, 0, 1]", "axis = [0, 0, 0]", ["joint.az.axis", "no direction"]),
    "unknown channel": (RIG, '"Tz"]', '"Mz"]', ["transducer.channels[6]", "'Mz' is not allowed"]),
    "stiffness without damping": (RIG, "damping =", "#", ["transducer.damping", "although stiffness is given"]),
    "given twice": (
        DRIVES,
        "[controller]",
        '[gravity]\nmagnitude = { value = 0, unit = "m/s^2", sigma = 0, source = "flight" }\n[controller]',
        ["gravity.magnitude", "is given in", "parameters/rig.toml:5"],
    ),
    "absent drive parameter": (DRIVES, "Ka = ", "# ", ["joint.az.drive.parameters.Ka", "'flexspline'", "N m/rad"]),
    "unknown drive parameter": (DRIVES, "Tmax =", "Tmx =", ["joint.az.drive.parameters.Tmx", "did you mean 'Tmax'"]),
    "drive parameter out of bounds": (DRIVES, "delta = { value = 0.5", "delta = { value = 5.0", ["delta", "out of bounds"]),
    "gains of another rig": (DRIVES, "Kp = { value = [0.05, 0.05]", "Kp = { value = [0.05]", ["controller.Kp.value", "array of 2"]),
    "bands of one name": (CAMPAIGN, "[1.0, 2.0]", "[1.0, 1.0000001, 2.0]", ["bands.low_pass_Hz", "would be called lt1Hz"]),
    "rate far beyond the bands": (CAMPAIGN, "working_rate_Hz = 20.0", "working_rate_Hz = 1e5", ["more than 100 times", "2 Hz"]),
    "high-pass beyond computing": (CAMPAIGN, "high_pass_Hz = 0.01", "high_pass_Hz = 1e-9", ["bands.high_pass_Hz", "cannot be cut"]),
    "mass beyond all": (RIG, "value = 8.0", "value = 1e308", ["body.base.mass.value", "1e+308 in SI", "at most 1e+06"]),
    "limit beyond all": (CAMPAIGN, "value = 0.06,", "value = 1e300,", ["limit", "1e+300 N m", "at most 1e+08 N m"]),
    "code of many turns": (RIG, "step = { value = 3.834951969714103e-4", "step = { value = 1e9", ["encoder.step.value", "1e+09 in SI", "at most 1"]),
    "inertia beyond all": (DRIVES, "rotor_inertia = { value = 2e-5", "rotor_inertia = { value = 1e11", ["rotor_inertia.value", "at most 1e+08"]),
    "rate beyond all": (CAMPAIGN, "high_pass_Hz = 0.01", "high_pass_Hz = 1e10", ["bands.high_pass_Hz", "greater than 1e+09"]),
    "no stiffness": (RIG, "[4000, 4000, 6000]", "[1e-308, 4000, 6000]", ["transducer.stiffness.value", "1e-308 in SI", "1e-15"]),
    "endless bias": (RIG, "bias = { value = [0,", "bias = { value = [1e12,", ["transducer.bias.value", "so large"]),
    "cycle of a microsecond": (DRIVES, "cycle = { value = 0.1", "cycle = { value = 1e-6", ["controller.cycle.value", "at least 1e-05"]),
    "latency for ever": (DRIVES, "latency = 1", "latency = 1_000_000_000_000", ["controller.latency", "greater than 1e+06"]),
    "half a cycle": (DRIVES, "latency = 1", "latency = 1.5", ["controller.latency", "is a number, not a whole number"]),
    "coupling that cannot be inverted": (RIG, "[0.0010, 0.0020, 0.0000, 0.0300, -0.0400, 0.0100]", "[0, 0, -1.0, 0, 0, 0]", ["cross_coupling"]),
    "no controller": (DRIVES, "loop = ", "# ", ["controller.loop", "is missing"]),
}  # fmt: skip

# Told at another line than that which was changed: the key is gone, or another one shows the fault.
ELSEWHERE = {
    "unknown effect", "rate too low", "repeat twice", "recording twice", "no commands", "loop", "given twice",
    "missing parameter file", "coupling that cannot be inverted", "stiffness without damping", "absent drive parameter", "no controller",
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_fault_is_refused(folder: CampaignFolder, fault: str) -> None:
    file, old, new, words = FAULTS[fault]
    line = folder.replace(file, old, new)
    error = folder.refusal()
    message = str(error)
    for word in words:
        assert word in message
    assert error.remedy or "\n  -> " in message
    assert file in message
    if fault not in ELSEWHERE:
        assert f"{file}:{line}: " in message


@pytest.mark.parametrize(
    ("file", "key", "number"),
    [(DRIVES, "latency", 1), (RIG, "order", 2), (CAMPAIGN, "repeat", 1), (CAMPAIGN, "schema", 1)],
)
def test_a_number_with_a_point_is_no_whole_number(folder: CampaignFolder, file: str, key: str, number: int) -> None:
    folder.replace(file, f"{key} = {number}", f"{key} = {number}.0")
    error = folder.refusal()
    assert file in error.where and error.where.endswith(key)
    assert error.what == f"{number}.0 is no whole number as TOML writes one"
    assert error.remedy == f"write {number}, without a point"


@pytest.mark.parametrize(("name", "what"), [(".", "it is a folder"), ("pipe", "it is a pipe"), ("zero", "outside the")])
@pytest.mark.parametrize(
    ("file", "old", "new", "field"),
    [
        (CAMPAIGN, "[model]", '[model]\nmodal = "{}"', "modal"),
        (CAMPAIGN, '"parameters/rig.toml"', '"{}"', "[parameters] files"),
        (CAMPAIGN, '"recordings/EL089P00_1.mcap"', '"{}"', "recording[2].file"),
        (RIG, "tilt = { value = [0.0, 0.0]", 'tilt = {{ value = "{}"', "transducer.tilt.value"),
    ],
)
def test_what_is_no_file_is_told_at_once(
    folder: CampaignFolder, name: str, what: str, file: str, old: str, new: str, field: str
) -> None:
    os.mkfifo(folder.path / "pipe")
    (folder.path / "zero").symlink_to("/dev/zero")
    folder.replace(file, old, new.format(name))
    message = str(folder.refusal())
    assert f"{folder.path / file}" in message or "in campaign.toml" in message
    assert field in message
    assert what in message or "it is a device" in message


def test_no_campaign_file(folder: CampaignFolder) -> None:
    (folder.path / CAMPAIGN).unlink()
    error = folder.refusal()
    assert "does not exist" in str(error)
    assert error.where.endswith(CAMPAIGN)


@pytest.mark.parametrize(
    ("text", "place"),
    [("name = \n", "campaign.toml:1"), ("a = 1\na = 2\n", "campaign.toml:2"), ("x = [1,\n", "campaign.toml:2")],
)
def test_malformed_toml_names_the_line(folder: CampaignFolder, text: str, place: str) -> None:
    (folder.path / CAMPAIGN).write_text(text)
    error = folder.refusal()
    assert error.where.endswith(place)
    assert "is not valid TOML" in error.what


def test_text_that_is_not_utf8(folder: CampaignFolder) -> None:
    (folder.path / CAMPAIGN).write_bytes(b'name = "\xff"\n')
    assert "not UTF-8" in str(folder.refusal())


def test_a_mark_of_the_byte_order_is_no_fault(folder: CampaignFolder) -> None:
    plain = load_campaign(folder.path)
    text = (folder.path / CAMPAIGN).read_bytes()
    (folder.path / CAMPAIGN).write_bytes(b"\xef\xbb\xbf" + text)
    assert load_campaign(folder.path).recordings == plain.recordings


def test_wrong_checksum_names_both(folder: CampaignFolder) -> None:
    stated = "0" * 64
    folder.replace(CAMPAIGN, 'role = "fit"', f'role = "fit"\nsha256 = "{stated}"')
    message = str(folder.refusal())
    assert stated in message
    assert hashlib.sha256(b"").hexdigest() in message
    assert "EL089P00_1.mcap" in message
    load_campaign(folder.path, checksums=False)


def test_requirement_at_the_spacecraft_needs_a_spacecraft(folder: CampaignFolder) -> None:
    text = (folder.path / RIG).read_text()
    first, last = text.index("[spacecraft]"), text.index("[body.base]")
    (folder.path / RIG).write_text(text[:first] + text[last:])
    assert "spacecraft's centre of mass" in str(folder.refusal())


def test_a_recording_that_is_listed_already_is_not_proposed_for_one_that_is_missing(folder: CampaignFolder) -> None:
    (folder.path / "recordings" / "EL089P00_2.mcap").rename(folder.path / "recordings" / "EL089P00_22.mcap")
    assert "did you mean 'EL089P00_22.mcap'?" in str(folder.refusal())
    (folder.path / "recordings" / "EL089P00_22.mcap").unlink()
    assert "known: AZPS_ATA.mcap, EL089P00_1.mcap, EL089P00_3.mcap" in str(folder.refusal())


def test_several_faults_are_told_at_once(folder: CampaignFolder) -> None:
    for name in ("base", "azimuth", "antenna"):
        folder.replace(RIG, f"[body.{name}]", f"[body.{name}]\ncolour = 'red'")
    for name in ("az", "el"):
        folder.replace(RIG, f"[joint.{name}]", f"[joint.{name}]\ncolour = 'red'")
        folder.replace(DRIVES, f"[joint.{name}.drive]", f"[joint.{name}.drive]\ncolour = 'red'")
    error = folder.refusal()
    assert error.what.startswith("7 things are wrong")
    assert str(error).count("colour: is not a key that is known here") == 5
    assert str(error).endswith("\nand 2 more")


def test_csv_matrix_with_nan_is_refused(folder: CampaignFolder) -> None:
    (folder.path / "tilt.csv").write_text("0.0, nan\n")
    folder.replace(RIG, "tilt = { value = [0.0, 0.0]", 'tilt = { value = "tilt.csv"')
    message = str(folder.refusal())
    assert "tilt.csv" in message
    assert "NaN" in message


def test_error_is_a_bad_input(folder: CampaignFolder) -> None:
    (folder.path / CAMPAIGN).unlink()
    assert ConfigError.exit_status == 2
    assert folder.refusal().exit_status == 2


@pytest.mark.parametrize("way", ["../../secret.csv", "absolute", "link"])
@pytest.mark.parametrize("place", ["value", "parameters", "modal", "mission"])
def test_no_file_outside_the_campaign_is_read(folder: CampaignFolder, place: str, way: str) -> None:
    secret = folder.path.parents[1] / "secret.csv"
    secret.write_text("root:x:0\n")
    if way == "link":
        (folder.path / "inside.csv").symlink_to(secret)
    name = {"absolute": str(secret), "link": "inside.csv"}.get(way, way)
    if place == "value":
        folder.replace(RIG, "tilt = { value = [0.0, 0.0]", f'tilt = {{ value = "{name}"')
    elif place == "parameters":
        folder.replace(CAMPAIGN, '"parameters/rig.toml"', f'"parameters/rig.toml", "{name}"')
    elif place == "modal":
        folder.replace(CAMPAIGN, "[model]", f'[model]\nmodal = "{name}"')
    else:
        folder.append(CAMPAIGN, f'[mission]\nfile = "{name}"\n')
    message = str(folder.refusal())
    assert f"the file '{name}' lies outside the campaign's folder" in message
    assert message.endswith("copy it into the folder") and "root:x" not in message
