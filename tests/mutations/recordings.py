"""MCAP recordings: damaged in their records or schemas, held against the `mcap` project's own readers."""

from __future__ import annotations

import json
import random
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from mcap.reader import NonSeekingReader, make_reader
from mcap.writer import CompressionType, Writer

from kbs_process.recordings.mcap.messages.encoding import OutStream
from kbs_process.recordings.mcap.source import open_recording
from kbs_process.recordings.mcap.streams import Stream
from kbs_process.reduction.inspection import inspect_recording
from kbs_process.signals.records import Loss
from mutations.subject import Subject, Tell, damaged
from recordings.mcap.mcap_files import FORCE, rewrite
from recordings.mcap.message_encodings import Encoding, write_encoded

FILE = "recording.mcap"
_COUNT = 600
_STREAMS = (Stream("wrench", "/wrench", FORCE), Stream("encoder", "/encoder", ("position[az]", "position[el]")))
_WORDS = (
    "float64",
    "float32",
    "int8",
    "uint16",
    "string",
    "bool",
    "float64[]",
    "float64[3]",
    "float64[<=2]",
    "Header",
    "x",
    "force",
    "# ",
    "=",
    "MSG:",
    "===",
    "a/b",
    "int64[99999999]",
    "",
)
Rows = list[tuple[str, int, tuple[float, ...]]]  # stream, stamp in ns, values


def sound() -> list[OutStream]:
    """What the sound recording holds."""
    rng = np.random.default_rng(11)
    stamp = 10_000_000 * np.arange(1, _COUNT + 1)
    return [
        OutStream("/wrench", "wrench", stamp, stamp + 5, rng.standard_normal((_COUNT, 6))),
        OutStream(
            "/encoder", "joints", stamp[::2], stamp[::2] + 7, rng.standard_normal((_COUNT // 2, 2)), ("az", "el")
        ),
    ]


def sound_rows() -> set[tuple[str, int, tuple[float, ...]]]:
    return {
        (one.key, int(stamp), tuple(values))
        for one, stream in zip(_STREAMS, sound(), strict=True)
        for stamp, values in zip(stream.stamp, stream.values.tolist(), strict=True)
    }


def _make(encoding: Encoding, checked: bool) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        whole = folder / "whole.mcap"
        write_encoded(whole, sound(), encoding)
        compression = CompressionType.ZSTD if checked else CompressionType.NONE
        crcs = {"enable_crcs": checked, "enable_data_crcs": checked}
        rewrite(whole, folder / FILE, compression=compression, chunk_size=4096, **crcs)
        whole.unlink()

    return make


def _mutate(rng: random.Random, folder: Path) -> str:
    changed, what = damaged(rng, (folder / FILE).read_bytes())
    (folder / FILE).write_bytes(changed)
    return what


def _mutate_schema(rng: random.Random, folder: Path) -> str:
    """Write the recording again with a word of a schema, or a character, replaced."""
    with (folder / FILE).open("rb") as file:
        messages = [(s, c, m) for s, c, m in make_reader(file).iter_messages(log_time_order=False) if s is not None]
    topics = sorted({channel.topic for _, channel, _ in messages})
    chosen, told = rng.choice(topics), ""
    with (folder / FILE).open("wb") as out:
        writer = Writer(out)
        writer.start(profile="ros2")
        known: dict[str, int] = {}
        for schema, channel, message in messages:
            if channel.topic not in known:
                data, name = schema.data, schema.name
                if channel.topic == chosen:
                    data, name, told = _changed(rng, data.decode(), name)
                number = writer.register_schema(name, schema.encoding, data)
                known[channel.topic] = writer.register_channel(channel.topic, channel.message_encoding, number)
            writer.add_message(known[channel.topic], message.log_time, message.data, message.publish_time)
        writer.finish()
    return f"{chosen}: {told}"


def _changed(rng: random.Random, text: str, name: str) -> tuple[bytes, str, str]:
    words = text.split(" ")
    at = rng.randrange(len(words))
    match rng.randrange(4):
        case 0:
            words[at] = rng.choice(_WORDS)
        case 1:
            lines = text.split("\n")
            del lines[rng.randrange(len(lines))]
            return "\n".join(lines).encode(), name, "a line missing"
        case 2:
            place = rng.randrange(len(text))
            return (text[:place] + chr(rng.randrange(32, 300)) + text[place + 1 :]).encode(), name, f"letter {place}"
        case _:
            return text.encode(), rng.choice(("", "x", "a/b/c", name[:-1])), "name"
    return " ".join(words).encode(), name, f"word {at} is {words[at]!r}"


def _judge(*, by_schema: bool = False) -> Callable[[Path, Tell], None]:
    """Read a recording; `by_schema` where numbers mean what a schema says that was changed."""

    def judge(folder: Path, tell: Tell) -> None:
        path = folder / FILE
        inspection = inspect_recording(path)
        every, losses = rows_of(path)
        base = sound_rows()
        lossy = bool(losses) or inspection.state != "clean"
        # A number that is none says nothing false, where the loss is told.
        got = [row for row in every if not (lossy and np.isnan(row[2]).any())]
        if len(got) == len(base) and set(got) == base:
            tell("right")
            return
        tell("reported" if lossy and (by_schema or set(got) <= base) else "wrong")
        try:
            other = list(_others(path))
        except Exception:  # noqa: BLE001  what that library makes of damage is not on trial
            return
        if Counter(map(repr, got)) == Counter(map(repr, other)):
            tell("right")
        elif lossy and set(got) <= set(other):
            tell("reported")

    return judge


def rows_of(path: Path) -> tuple[Rows, list[Loss]]:
    """Return what a recording holds, and what is lost of it."""
    source, every = open_recording(path), Rows()
    for key, block in source.read(_STREAMS):
        every += [(key, int(s), tuple(v)) for s, v in zip(block.stamp, block.values.tolist(), strict=True)]
    return every, list(source.losses)


def _others(path: Path) -> Iterator[tuple[str, int, tuple[float, ...]]]:
    """Yield what the `mcap` project's readers have of a recording."""
    from mcap_ros2.decoder import DecoderFactory

    ros2 = DecoderFactory()
    with path.open("rb") as file:
        for schema, channel, message in NonSeekingReader(file).iter_messages(log_time_order=False):
            if channel.message_encoding == "json":
                yield _row(channel.topic, json.loads(message.data).__getitem__)
            elif channel.message_encoding == "cdr":
                decoder = ros2.decoder_for("cdr", schema)
                assert decoder is not None
                decoded = decoder(message.data)
                yield _row(channel.topic, lambda name, own=decoded: _plain(getattr(own, name)))


def _plain(node: Any) -> Any:
    """A decoded message as dictionaries."""
    slots = getattr(node, "__slots__", None)
    return {name: _plain(getattr(node, name)) for name in slots} if slots else node


def _row(topic: str, part: Callable[[str], Any]) -> tuple[str, int, tuple[float, ...]]:
    stamp = part("header")["stamp"]
    ns = int(stamp["sec"]) * 1_000_000_000 + int(stamp["nanosec"])
    if topic == "/wrench":
        wrench = part("wrench")
        return "wrench", ns, tuple(float(wrench[kind][axis]) for kind in ("force", "torque") for axis in "xyz")
    places = [list(part("name")).index(name) for name in ("az", "el")]
    return "encoder", ns, tuple(float(part("position")[place]) for place in places)


SUBJECTS = (
    Subject("mcap ros2", 3.0, _make("ros2", True), _mutate, _judge()),
    Subject("mcap ros2, no checksums", 2.0, _make("ros2", False), _mutate, _judge()),
    Subject("mcap json", 1.0, _make("json", True), _mutate, _judge()),
    Subject("mcap json, no checksums", 1.0, _make("json", False), _mutate, _judge()),
    Subject("mcap protobuf", 1.0, _make("protobuf", True), _mutate, _judge()),
    Subject("schemas", 1.5, _make("ros2", True), _mutate_schema, _judge(by_schema=True)),
)
