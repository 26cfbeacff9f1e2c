"""Every bad input ends the command with status 2 and one message: which file, what in it, and what to do.

What was in the results folder before stays as it was.
"""

# ruff: noqa: E501  (a table reads best with a fault a line)

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

import pytest

from campaign.campaign_folder import CampaignFolder
from end_to_end.command import kbs_process
from end_to_end.short_campaign import record
from kbs_process.campaign.load import load_campaign
from kbs_process.results.store import LIST, writing

pytestmark = pytest.mark.slow

CAMPAIGN, RIG = "campaign.toml", "parameters/rig.toml"
FIRST = "AZPS_ATA.mcap"


@pytest.fixture
def refused(folder: CampaignFolder, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Callable[[], str]:
    """Processes the folder, which must be refused, and returns the message."""
    target = tmp_path / "results"
    with writing(target) as folder_of_before:
        (folder_of_before / "results.json").write_text("old")
        (folder_of_before / "index.html").write_text("old page")

    def run() -> str:
        ended = kbs_process(capsys, folder.path, "-o", target, "-q")
        assert ended.status == 2, ended.err
        assert ended.out == ""
        assert ended.err.startswith("error: ")
        assert "Traceback" not in ended.err
        assert "\n  -> " in ended.err
        assert {path.name: path.read_text() for path in target.iterdir() if path.name != LIST} == {
            "results.json": "old",
            "index.html": "old page",
        }
        assert not list(tmp_path.glob(".results.new-*"))
        return ended.err

    return run


# file, text, what it becomes, and what the message has to say; tests/campaign has every fault of a description
DESCRIPTION = {
    "malformed": (CAMPAIGN, "schema = 1", "schema = ", ["campaign.toml:2", "is not valid TOML"]),
    "unknown key": (CAMPAIGN, "high_pass_Hz =", "highpass_Hz =", ["bands.highpass_Hz", "did you mean 'high_pass_Hz'"]),
    "wrong unit": (RIG, 'value = 8.0, unit = "kg"', 'value = 8.0, unit = "m"', ["body.base.mass.unit", "kg"]),
    "no sigma": (RIG, 'unit = "kg", sigma = 0.05, source', 'unit = "kg", source', ["body.base.mass.sigma", "is missing"]),
    "NaN": (RIG, "value = 8.0", "value = nan", ["body.base.mass.value", "not a finite"]),
    "infinity": (CAMPAIGN, "working_rate_Hz = 20.0", "working_rate_Hz = inf", ["bands.working_rate_Hz", "not a finite"]),
    "absent topic": (CAMPAIGN, '"/encoder"', '"/encodr"', [FIRST, "no topic '/encodr'", "did you mean '/encoder'"]),
    "absent wrench": (CAMPAIGN, '"/transducer/wrench"', '"/dyno"', [FIRST, "no topic '/dyno'", "/transducer/wrench"]),
    "wrong type for the wrench": (CAMPAIGN, '"/transducer/wrench"', '"/encoder"', [FIRST, "/encoder", "wrench.force.x"]),
    "wrong type for the encoder": (CAMPAIGN, 'encoder = "/encoder"', 'encoder = "/transducer/wrench"', [FIRST, "/transducer/wrench", "position"]),
}  # fmt: skip


@pytest.mark.parametrize("fault", DESCRIPTION)
def test_descriptions(folder: CampaignFolder, refused: Callable[[], str], fault: str) -> None:
    file, old, new, words = DESCRIPTION[fault]
    folder.replace(file, old, new)
    message = refused()
    for word in words:
        assert word in message, message


def test_no_description(folder: CampaignFolder, refused: Callable[[], str]) -> None:
    (folder.path / CAMPAIGN).unlink()
    message = refused()
    assert f"is no campaign: it holds no {CAMPAIGN}" in message
    assert "name the folder that holds it" in message


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", ["the file is empty", "record or copy it again"]),
        (b"t,Fx,Fy\n0,1,2\n", ["not an MCAP file", "kbs-process import"]),
        (b"\x89MCAP0\r\n", ["EL089P00_2.mcap"]),
    ],
)
def test_files_without_a_recording(
    folder: CampaignFolder, refused: Callable[[], str], content: bytes, words: list[str]
) -> None:
    (folder.path / "recordings" / "EL089P00_2.mcap").write_bytes(content)
    message = refused()
    for word in ("EL089P00_2.mcap", *words):
        assert word in message, message


def test_a_recording_that_was_changed(folder: CampaignFolder, refused: Callable[[], str]) -> None:
    stated = hashlib.sha256(b"another").hexdigest()
    folder.replace(CAMPAIGN, 'role = "fit"', f'role = "fit"\nsha256 = "{stated}"')
    message = refused()
    assert "EL089P00_1.mcap" in message
    assert stated in message


def test_a_channel_that_is_no_number(folder: CampaignFolder, refused: Callable[[], str]) -> None:
    record(folder.path / "recordings" / "EL089P00_2.mcap", nan=slice(None))
    message = refused()
    for word in ("recordings/EL089P00_2.mcap: wrench", "Fz in 2000", "transducer.channels"):
        assert word in message, message


def test_a_joint_that_no_encoder_reads(folder: CampaignFolder, refused: Callable[[], str]) -> None:
    record(folder.path / "recordings" / "EL089P00_2.mcap", read=("el",))
    message = refused()
    for word in ("EL089P00_2.mcap, /encoder", "'az' of position", "known: el", "`joints` of [topics.encoder]"):
        assert word in message, message


def test_recordings_without_motion(folder: CampaignFolder, refused: Callable[[], str]) -> None:
    """A singular fit: the message names the recordings, and the parameters that they cannot tell apart."""
    for path in (folder.path / "recordings").iterdir():
        record(path, moving=False)
    message = refused()
    assert "no joint moves in AZPS_ATA, EL089P00_1" in message
    assert "body.antenna.cog" in message
    assert "zeros of the readings" in message


def test_angles_in_degrees_are_told_where_the_plant_has_no_solution_for_them(
    folder: CampaignFolder, refused: Callable[[], str]
) -> None:
    rig = load_campaign(folder.path, checksums=False).rig
    for path in (folder.path / "recordings").iterdir():
        record(path, rig=rig, degrees=True)
    message = refused()
    assert "the model of this rig is wrong" in message
    assert "unit: angles of az, el are degrees" in message
    assert "no static equilibrium" in message
