"""What inspection tells of a recording is what processing tells of it, fault by fault."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import pytest

from campaign.campaign_folder import CampaignFolder, make_folder
from end_to_end.damage import alter, with_earlier_stamp, with_last_number
from end_to_end.short_campaign import record
from kbs_process.campaign.load import load_campaign
from kbs_process.errors import RecordingError
from kbs_process.progress import SilentProgress
from kbs_process.reduction.inspection import inspect_recording
from kbs_process.reduction.reading import read_run
from kbs_process.studies.correlate.run import process
from kbs_process.studies.validate.run import describe, validate

NAME = "EL089P00_1"
TOPICS = {"wrench": "/transducer/wrench", "angle": "/encoder"}
ZEROS = bytes(48)
Change = Callable[[float, bytes], bytes]


def angle_off(payload: bytes, by: float) -> bytes:
    """A joint state whose second position is off."""
    at = len(payload) - 8 - 8  # two empty sequences follow the positions
    return payload[:at] + struct.pack("<d", struct.unpack_from("<d", payload, at)[0] + by) + payload[at + 8 :]


FAULTS: dict[str, tuple[str, Change, str]] = {
    "none": ("wrench", lambda t, p: p, ""),
    "spike": ("wrench", lambda t, p: with_last_number(p, 30.0) if t == 11.0 else p, "spike"),
    "zeros": ("wrench", lambda t, p: p[:-48] + ZEROS if 11.0 <= t < 11.2 else p, "dropout"),
    "odd stamp": ("wrench", lambda t, p: with_earlier_stamp(p, 3) if t in (8.0, 12.0) else p, "odd stamp"),
    "clock": ("wrench", lambda t, p: with_earlier_stamp(p, 3) if t >= 8.0 else p, "refused"),
    "angle": ("angle", lambda t, p: angle_off(p, 1.0) if t == 11.0 else p, "spike"),
    "count": ("angle", lambda t, p: angle_off(p, 0.4) if t >= 11.0 else p, "refused"),
}


@pytest.fixture
def folder(tmp_path: Path) -> CampaignFolder:
    made = make_folder(tmp_path / "EL089")
    record(made.path / "recordings" / f"{NAME}.mcap", noise=0.01)
    return made


@pytest.mark.parametrize("fault", FAULTS)
def test_one_judgement(folder: CampaignFolder, fault: str) -> None:
    key, change, kind = FAULTS[fault]
    path = folder.path / "recordings" / f"{NAME}.mcap"
    alter(path, TOPICS[key], lambda t, payload: change(round(t, 6), payload))
    campaign = load_campaign(folder.path, checksums=False)
    found = inspect_recording(path)
    inspected = {(loss.kind, loss.count) for loss in found.losses if loss.where.startswith(TOPICS[key])}
    assert found.state == ("lossy" if kind else "clean")
    if kind == "refused":
        with pytest.raises(RecordingError) as error:
            read_run(campaign, campaign.recording(NAME))
        details = [loss.detail for loss in found.losses if loss.kind == "unusable"]
        said = [detail.replace("position[el] ", "el ") for detail in details]
        assert said == [error.value.what]
        return
    losses = read_run(campaign, campaign.recording(NAME)).losses
    assert {(loss.kind, loss.count) for loss in losses} == inspected
    assert kind in {loss.kind for loss in losses} or not kind


@pytest.mark.slow
@pytest.mark.parametrize("good", [lambda k: k * k % 23 < 4, lambda k: k % 50 < 10], ids=["scattered", "ten in a row"])
def test_a_refusal_names_what_most_of_the_recording_was_lost_by_as_its_inspection_does(
    folder: CampaignFolder, good: Callable[[int], bool]
) -> None:
    """Nanoseconds that are none in most messages."""
    rig = load_campaign(folder.path, checksums=False).rig
    for number, path in enumerate(sorted((folder.path / "recordings").iterdir())):
        record(path, noise=0.002, seed=number, rig=rig)
    bad = folder.path / "recordings" / f"{NAME}.mcap"
    alter(bad, TOPICS["wrench"], lambda t, p: p if good(round(100 * t)) else p[:8] + b"\xff" * 4 + p[12:])
    campaign = load_campaign(folder.path, checksums=False)
    first = next(loss for loss in inspect_recording(bad).losses if loss.real)
    assert first.kind == "no valid stamp" and first.count > 1000
    with pytest.raises(RecordingError) as error:
        process(campaign, folder.path / "results", progress=SilentProgress(), page=False)
    assert f"{first.count} x no valid stamp" in str(error.value) and first.detail in str(error.value)
    told = "\n".join(describe(campaign, validate(campaign, SilentProgress())))
    assert str(error.value) in told
