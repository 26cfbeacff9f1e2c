"""Two publishers of one topic: refused by name until one is chosen, and then read as if it were alone."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

from campaign.campaign_folder import CampaignFolder, make_folder
from end_to_end.short_campaign import record
from kbs_process.campaign.load import load_campaign
from kbs_process.errors import RecordingError
from kbs_process.reduction.inspection import inspect_recording
from kbs_process.reduction.reading import read_run
from kbs_process.signals.records import Run

TOPIC = "/transducer/wrench"
NAME = "EL089P00_1"
HALF = 5_000_000  # ns
HEADER = 12  # bytes before the wrench's numbers: encapsulation, stamp


def second_publisher(path: Path, *, channels: int, every: int) -> int:
    """Add wrenches of an unloaded transducer between the others; return the number of the first one's channel."""
    with io.BytesIO(path.read_bytes()) as file, path.open("wb") as out:
        writer = Writer(out, chunk_size=1 << 15)
        writer.start(profile="ros2", library="test")
        numbers: dict[int, list[int]] = {}
        count, mine = 0, 0
        for schema, channel, message in make_reader(file).iter_messages(log_time_order=False):
            if channel.id not in numbers:
                assert schema is not None
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                made = channels if channel.topic == TOPIC else 1
                numbers[channel.id] = [
                    writer.register_channel(channel.topic, channel.message_encoding, number) for _ in range(made)
                ]
            own = numbers[channel.id]
            writer.add_message(own[0], message.log_time, message.data, message.publish_time)
            if channel.topic == TOPIC:
                mine = own[0]
                count += 1
                if count % every == 0:
                    seconds, rest = divmod(message.log_time + HALF, 1_000_000_000)
                    head = message.data[:4] + seconds.to_bytes(4, "little") + rest.to_bytes(4, "little")
                    data = head + message.data[HEADER:-48] + bytes(48)
                    writer.add_message(own[-1], message.log_time + HALF, data, message.log_time + HALF)
        writer.finish()
    return mine


def read(folder: CampaignFolder) -> Run:
    campaign = load_campaign(folder.path, checksums=False)
    return read_run(campaign, campaign.recording(NAME))


@pytest.fixture
def folder(tmp_path: Path) -> CampaignFolder:
    made = make_folder(tmp_path / "EL089")
    record(made.path / "recordings" / f"{NAME}.mcap", noise=0.01)
    return made


@pytest.mark.parametrize("every", [1, 7])
def test_one_of_two_channels_has_to_be_chosen(folder: CampaignFolder, every: int) -> None:
    path = folder.path / "recordings" / f"{NAME}.mcap"
    alone = read(folder)
    number = second_publisher(path, channels=2, every=every)
    with pytest.raises(RecordingError, match="2 publishers bring the topic of 'wrench' by turns, in channels") as found:
        read(folder)
    assert "under [topics.wrench], give `topic` and `channel`" in found.value.remedy
    inspection = inspect_recording(path)
    assert inspection.state == "lossy"
    assert [loss.where for loss in inspection.losses if loss.kind == "publishers"] == [TOPIC]
    folder.replace("campaign.toml", f'wrench = "{TOPIC}"', f'wrench = {{ topic = "{TOPIC}", channel = {number} }}')
    chosen = read(folder)
    assert chosen.losses == () and chosen.wrench is not None and alone.wrench is not None
    np.testing.assert_array_equal(chosen.wrench.values, alone.wrench.values)


@pytest.mark.parametrize("every", [1, 2, 5])
def test_two_in_one_channel_are_refused(folder: CampaignFolder, every: int) -> None:
    path = folder.path / "recordings" / f"{NAME}.mcap"
    second_publisher(path, channels=1, every=every)
    with pytest.raises(RecordingError, match=r"wrench: \w+ changes to and fro .* two sources are in one stream"):
        read(folder)
    (refused,) = [loss for loss in inspect_recording(path).losses if loss.kind == "unusable"]
    assert refused.where == TOPIC and "two sources are in one stream" in refused.detail
