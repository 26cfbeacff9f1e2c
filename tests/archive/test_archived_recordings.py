"""The archive is what its tool makes: checksums, truths, and the beginning of a recording made again."""

from __future__ import annotations

import hashlib
import json
import tomllib

import numpy as np
import pytest
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory

from engine.archive import TRUTH_FOLDER, make
from engine.campaigns import CAMPAIGNS, CAMPAIGNS_FOLDER
from engine.hardware import Hardware
from engine.mcap_file import write
from engine.trajectories import TRAJECTORIES

LARGEST_ARCHIVE = 22e6  # bytes: the archive is part of every clone


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_checksums(name: str) -> None:
    folder = CAMPAIGNS_FOLDER / name
    recordings = tomllib.loads((folder / "campaign.toml").read_text())["recording"]
    assert [entry["file"] for entry in recordings] == [f"recordings/{run.file}" for run in CAMPAIGNS[name].runs]
    for entry in recordings:
        assert hashlib.sha256((folder / entry["file"]).read_bytes()).hexdigest() == entry["sha256"], entry["file"]


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_truth_is_the_hardware_drawn(name: str) -> None:
    truth = json.loads((TRUTH_FOLDER / f"{name}.json").read_text())
    hardware = CAMPAIGNS[name].hardware()
    assert set(truth["hardware"]) == set(hardware.values)
    for key, value in hardware.values.items():
        np.testing.assert_allclose(truth["hardware"][key], value, rtol=1e-14, err_msg=key)


@pytest.mark.parametrize("name", ["EL089_ADC", "APM_1996"])
def test_what_the_paper_asked_for_is_tried_on_the_article_of_1996(name: str) -> None:
    ours, theirs = (CAMPAIGNS[each].hardware().values for each in (name, "EL089_1996"))
    for key, value in theirs.items():
        assert np.array_equal(ours[key], value) or (name, key.rpartition(".")[0]) == ("APM_1996", "body.antenna"), key


def test_a_measured_inclination_is_that_of_the_article() -> None:
    campaign = CAMPAIGNS["EL089_1996"]
    files = ("parameters/aligned.toml", "parameters/bounds.toml")
    stated, true = Hardware.from_campaign(campaign.folder, files=files), campaign.hardware()
    off = np.abs(stated["transducer.tilt"] - true["transducer.tilt"])
    assert np.all(off < 2.0 * stated.sigmas["transducer.tilt"])


def test_archive_is_small() -> None:
    total = sum(
        (campaign.folder / "recordings" / run.file).stat().st_size
        for campaign in CAMPAIGNS.values()
        for run in campaign.runs
    )
    assert total <= LARGEST_ARCHIVE


@pytest.mark.slow
@pytest.mark.parametrize(("name", "index"), [("EL089", 1), ("ACQ600", 1), ("ALSTPP00", 1)])
def test_beginning_of_a_recording_comes_out_the_same(name: str, index: int, tmp_path) -> None:
    campaign = CAMPAIGNS[name]
    run = campaign.runs[index]
    path = TRAJECTORIES[run.trajectory]()
    again = make(campaign, index, path.until(5.0))
    write(tmp_path / "again.mcap", again, run.form)
    messages: dict[str, list[tuple[int, int, bytes]]] = {}
    for file, most in ((tmp_path / "again.mcap", None), (campaign.folder / "recordings" / run.file, 5.5)):
        count: dict[str, int] = {}
        with file.open("rb") as stream:
            for _, channel, message in make_reader(stream, validate_crcs=True).iter_messages():
                k = count[channel.topic] = count.get(channel.topic, -1) + 1
                found = (message.log_time, message.publish_time, message.data)
                if most is None:
                    messages.setdefault(channel.topic, []).append(found)
                elif k < len(messages[channel.topic]):
                    assert found == messages[channel.topic][k], f"{channel.topic} {k}"
                elif min(count.values()) > max(map(len, messages.values())):
                    break
    assert set(messages) == {"/transducer/wrench", "/encoder", "/command", "/motor/field"}
    assert len(messages["/transducer/wrench"]) > 490


@pytest.mark.slow
def test_any_ros2_reader_decodes_the_messages() -> None:
    file = CAMPAIGNS["EL089"].folder / "recordings" / "EL089P00_1.mcap"
    first: dict[str, object] = {}
    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages():
            first.setdefault(channel.topic, message)
            if len(first) == 4:
                break
    assert first["/encoder"].name == ["az", "el"]
    assert first["/encoder"].position[1] == pytest.approx(np.radians(70.0), abs=2e-3)
    assert first["/command"].velocity == [0.0, 0.0]
    assert first["/motor/field"].position[1] == pytest.approx(100 * np.radians(70.0), abs=1e-4)
    wrench = first["/transducer/wrench"].wrench
    assert wrench.force.z == pytest.approx(-274.6, abs=12.0)
    assert first["/transducer/wrench"].header.frame_id == "transducer"


def test_the_power_loss_is_one() -> None:
    file = CAMPAIGNS["ACQ600"].folder / "recordings" / "ACQ600_2.mcap"
    with file.open("rb") as stream, pytest.raises(McapError):
        for _ in StreamReader(stream, validate_crcs=True).records:
            pass
