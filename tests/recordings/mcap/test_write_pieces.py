"""Recordings written a piece at a time: the same bytes, in bounded memory."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Message
from mcap.writer import Writer

from kbs_process.errors import RecordingError
from kbs_process.recordings.mcap import chunks, writer
from kbs_process.recordings.mcap.messages.encoding import OutStream
from kbs_process.recordings.mcap.source import open_recording
from kbs_process.recordings.mcap.streams import Stream
from kbs_process.recordings.mcap.writer import write_mcap, write_pieces

START = 1_700_000_000_000_000_000


def temperature(first: int, last: int, *, every: int = 1_000_000) -> OutStream:
    """Messages first .. last - 1 of a temperature's stream, `every` ns apart."""
    stamp = START + every * np.arange(first, last)
    values = np.sin(np.arange(first, last) * 0.01)[:, None]
    return OutStream(f"/t{every}", "temperature", stamp, stamp + 500, values)


def messages(path: Path) -> list[Message]:
    """Return the messages in the order of the file, by an independent reader."""
    with path.open("rb") as file:
        return [message for _, _, message in make_reader(file).iter_messages(log_time_order=False)]


def pieces(count: int, size: int) -> Iterator[OutStream]:
    """Yield two streams, one ten times faster, side by side."""
    for first in range(0, count, size):
        yield temperature(first, min(first + size, count))
        slow = slice(-(-first // 10), -(-min(first + size, count) // 10))
        yield temperature(slow.start, slow.stop, every=10_000_000)


def test_pieces_of_any_size_give_the_bytes_of_the_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(writer, "BATCH", 500)
    whole = [temperature(0, 3000), temperature(0, 300, every=10_000_000)]
    write_mcap(tmp_path / "whole.mcap", whole)
    logs = [message.log_time for message in messages(tmp_path / "whole.mcap")]
    assert logs == sorted(logs)
    for size in (70, 999):
        write_pieces(tmp_path / "pieces.mcap", pieces(3000, size))
        assert (tmp_path / "pieces.mcap").read_bytes() == (tmp_path / "whole.mcap").read_bytes()


def test_the_bytes_are_those_of_the_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Which writes one message after the other: chunks, indexes and summary alike."""
    monkeypatch.setattr(chunks, "CHUNK", 1 << 14)
    stamp = START + 3_000_000 * np.arange(300)
    joints = OutStream(
        "/j", "joints", stamp, stamp + 7, np.random.default_rng(1).normal(size=(300, 4)), ("az", "b\u00e9")
    )
    wrench = OutStream("/w", "wrench", stamp, stamp, np.full((300, 6), np.nan), frame="transducer")
    path = tmp_path / "a.mcap"
    write_mcap(path, [temperature(0, 3000), joints, wrench, temperature(0, 0, every=5)])
    with path.open("rb") as file:
        reader = make_reader(file)
        summary, found = reader.get_summary(), list(reader.iter_messages(log_time_order=False))
    assert summary is not None
    with (tmp_path / "b.mcap").open("wb") as file:
        library = Writer(file, chunk_size=1 << 14, enable_data_crcs=True)
        library.start(profile="ros2", library="kbs-process")
        for number, channel in summary.channels.items():
            schema = summary.schemas[channel.schema_id]
            assert library.register_schema(schema.name, schema.encoding, schema.data) == channel.schema_id
            assert library.register_channel(channel.topic, channel.message_encoding, channel.schema_id) == number
        for _, _, one in found:
            library.add_message(one.channel_id, one.log_time, one.data, one.publish_time, one.sequence)
        library.finish()  # type: ignore[no-untyped-call]
    assert len(found) == 3600
    assert (tmp_path / "b.mcap").read_bytes() == path.read_bytes()


@pytest.mark.slow
def test_memory_does_not_grow_with_the_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(writer, "BATCH", 2000)
    monkeypatch.setattr(chunks, "CHUNK", 1 << 16)
    write_pieces(tmp_path / "a.mcap", pieces(100, 10))  # whatever is made once only
    peaks = []
    for count in (10_000, 40_000):
        tracemalloc.start()
        write_pieces(tmp_path / "a.mcap", pieces(count, 500))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.3 * peaks[0]  # the index has a few bytes a message
    assert peaks[1] < 44_000 * 60  # bytes of the payloads alone


def test_a_topic_that_falls_silent_holds_up_no_more_than_it_may(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beyond `hold` messages the older are written, and a late piece goes behind them."""
    monkeypatch.setattr(writer, "BATCH", 100)
    late = temperature(0, 5, every=10_000_000)

    def falling_silent() -> Iterator[OutStream]:
        yield late
        for first in range(0, 5000, 100):
            yield temperature(first, first + 100)
        yield temperature(5, 6, every=10_000_000)

    write_pieces(tmp_path / "a.mcap", falling_silent(), hold=400)
    source = open_recording(tmp_path / "a.mcap")
    read = list(source.read([Stream(t, t, ("temperature",)) for t in ("/t1000000", late.topic)]))
    assert not source.losses
    slow = np.concatenate([block.values for topic, block in read if topic == late.topic])
    fast = np.concatenate([block.stamp for topic, block in read if topic != late.topic])
    assert np.array_equal(slow, temperature(0, 6, every=10_000_000).values)
    assert np.array_equal(fast, temperature(0, 5000).stamp)


def test_stamps_out_of_order_are_put_in_order_within_reach(tmp_path: Path) -> None:
    a, b = temperature(0, 50), temperature(50, 100)
    write_pieces(tmp_path / "a.mcap", iter([b, a]))
    ((_, block),) = open_recording(tmp_path / "a.mcap").read([Stream("t", a.topic, ("temperature",))])
    assert np.array_equal(block.stamp, temperature(0, 100).stamp)


def test_what_a_clock_that_starts_at_zero_reads_before_it_is_left_out(tmp_path: Path) -> None:
    stamp = np.array([-7, 0, 5])  # ns; a stream that is put on another's clock may begin a moment earlier
    write_mcap(tmp_path / "a.mcap", [OutStream("/t", "temperature", stamp, stamp + 1, np.array([[1.0], [2.0], [3.0]]))])
    ((_, block),) = open_recording(tmp_path / "a.mcap").read([Stream("t", "/t", ("temperature",))])
    assert block.stamp.tolist() == [0, 5] and block.values[:, 0].tolist() == [2.0, 3.0]


def test_a_source_that_fails_leaves_nothing(tmp_path: Path) -> None:
    def failing() -> Iterator[OutStream]:
        yield temperature(0, 10)
        raise RecordingError("the source is damaged")

    with pytest.raises(RecordingError, match="damaged"):
        write_pieces(tmp_path / "a.mcap", failing())
    assert not list(tmp_path.iterdir())


def test_pieces_that_do_not_belong_together_are_refused(tmp_path: Path) -> None:
    stamp = START + np.arange(5)
    placed, moving = (OutStream("/e", "joints", stamp, stamp, np.ones((5, parts)), ("az",)) for parts in (1, 2))
    with pytest.raises(ValueError, match="different kinds"):
        write_pieces(tmp_path / "a.mcap", [placed, moving])
