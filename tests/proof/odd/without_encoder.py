"""A campaign whose bench had no encoders: their topic goes out of the recordings and out of the description."""

from __future__ import annotations

from pathlib import Path

from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

TOPIC = "/encoder"
_COMMANDED = """field = "/motor/field"

[topics.encoder]
topic = "/command"
fields = ["position[az]", "position[el]"]
"""


def drop_messages(file: Path) -> None:
    """Write the recording anew without its encoders. Equal input gives equal bytes."""
    part = file.with_suffix(".part")
    with file.open("rb") as old, part.open("wb") as new:
        reader, writer = make_reader(old), Writer(new, compression=CompressionType.ZSTD)
        writer.start(profile=reader.get_header().profile, library="kbs engine")
        channels: dict[int, int] = {}
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            if channel.topic == TOPIC:
                continue
            assert schema is not None
            if channel.id not in channels:
                kind = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, kind)
            writer.add_message(
                channels[channel.id], message.log_time, message.data, message.publish_time, message.sequence
            )
        writer.finish()
    part.replace(file)


def describe(folder: Path, *, command_in_its_place: bool) -> None:
    """Take the encoders out of campaign.toml; the motion then is measured nowhere, or taken to be as commanded."""
    file = folder / "campaign.toml"
    text = file.read_text().replace(f'encoder = "{TOPIC}"\n', "")
    if command_in_its_place:
        text = text.replace('drive = "command"', 'drive = "motion"')
        text = text.replace('field = "/motor/field"\n', _COMMANDED)
    file.write_text(text)
