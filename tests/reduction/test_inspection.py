"""What `inspect_recording` says of a recording whose defects are known."""

from __future__ import annotations

import tracemalloc
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer

from kbs_process.recordings.mcap.messages.encoding import OutStream
from kbs_process.recordings.mcap.source import open_recording
from kbs_process.recordings.mcap.streams import Stream
from kbs_process.recordings.mcap.writer import write_mcap
from kbs_process.reduction import inspection
from kbs_process.reduction.inspection import inspect_recording
from kbs_process.stages.align.stream import Collected
from kbs_process.studies.validate.listing import describe_inspection
from recordings.mcap.mcap_files import build
from recordings.mcap.message_encodings import Encoding, write_encoded


@pytest.mark.parametrize("encoding", ["ros2", "json", "protobuf"])
def test_rates_gaps_repeats_and_ranges(tmp_path: Path, encoding: Encoding) -> None:
    rng = np.random.default_rng(4)
    n = 20_000
    log = 1_000_000 * np.arange(n)
    log[5000:] += 20_000_000  # a gap
    stamp = log + rng.integers(-1000, 1000, n)
    stamp[700] = stamp[699]  # a repeat
    stamp[[900, 901]] = stamp[[901, 900]]  # two in the wrong order
    wrench = rng.uniform(-2, 3, (n, 6))
    wrench[17, 1] = np.nan
    joints = np.column_stack([np.linspace(0, 1, 100), np.linspace(2, 3, 100)])
    streams = [
        OutStream("/wrench", "wrench", stamp, log, wrench),
        OutStream("/encoder", "joints", log[:100], log[:100], joints, ("az", "el")),
    ]
    write_encoded(tmp_path / "a.mcap", streams, encoding)
    found = inspect_recording(tmp_path / "a.mcap")
    assert found.state == "lossy"  # the NaN
    encoder, topic = found.topics
    assert (topic.topic, topic.count) == ("/wrench", n)
    assert topic.rate_Hz == pytest.approx(1000, rel=0.01)
    told = {loss.kind: loss for loss in found.losses if loss.where == "/wrench"}
    assert {kind: loss.count for kind, loss in told.items()} == {"gap": 20, "repeat": 1, "put in order": 1}
    assert told["gap"].start_s == pytest.approx(4.999, abs=1e-3) and told["gap"].end_s == pytest.approx(5.02, abs=1e-3)
    assert (topic.start_ns, topic.end_ns) == (stamp.min(), stamp.max())
    limits = {entry.field: entry for entry in topic.ranges}
    assert limits["wrench.torque.z"].low == wrench[:, 5].min()
    assert limits["wrench.torque.z"].high == wrench[:, 5].max()
    assert limits["wrench.force.y"].not_finite == 1
    assert encoder.names == ("az", "el")
    assert [(e.field, e.low, e.high) for e in encoder.ranges][:2] == [("position[az]", 0, 1), ("position[el]", 2, 3)]


@pytest.mark.parametrize(
    ("lost", "count", "times"),
    [
        (np.s_[:, [1, 3]], 0, None),  # channels that the source never had
        (np.s_[17:20, 0], 3, (0.17, 0.19)),
        (np.s_[:15_000, 1], 15_000, (0.0, 149.99)),  # in many blocks, before the channel comes
        (np.s_[15_000:, 1], 5_000, (150.0, 199.99)),
        (np.s_[:, :], 20_000, (0.0, 199.99)),  # nothing is left
    ],
)
def test_a_channel_without_any_reading_is_no_loss(
    tmp_path: Path, lost: tuple[slice, list[int]], count: int, times: tuple[float, float] | None
) -> None:
    t, wrench = np.arange(20_000) * 10_000_000, np.random.default_rng(1).normal(0.0, 1.0, (20_000, 6))
    wrench[10_000, 5] = 1e3  # a single sample off its neighbours
    wrench[lost] = np.nan
    write_mcap(tmp_path / "a.mcap", [OutStream("/wrench", "wrench", t, t, wrench)])
    found = inspect_recording(tmp_path / "a.mcap")
    told = [(one.count, (one.start_s, one.end_s)) for one in found.losses if one.kind == "non-finite"]
    assert told == ([(count, pytest.approx(times))] if times else [])
    assert times or [(one.kind, one.where) for one in found.losses] == [("spike", "/wrench, wrench.torque.z")]
    said = [line.split()[-2:] for line in describe_inspection(found) if "wrench.torque.x" in line]
    assert (said == [["no", "reading"]]) == np.isnan(wrench[:, 3]).all()


def test_a_clock_that_was_set_is_told_as_processing_tells_it(tmp_path: Path) -> None:
    t = np.arange(6000) * 10_000_000
    rng = np.random.default_rng(1)
    force, angle = rng.normal(0.0, 1.0, (6000, 6)), np.cumsum(rng.normal(0.0, 1e-4, (6000, 1)), axis=0)
    log = t + 200_000 + rng.exponential(1e5, 6000).astype(np.int64)
    streams = [
        OutStream("/wrench", "wrench", t, log, force),
        OutStream("/encoder", "joints", np.where(t < 30 * 10**9, t, t + 400_000_000), log, angle, ("arm",)),
    ]
    write_mcap(tmp_path / "a.mcap", streams)
    found = inspect_recording(tmp_path / "a.mcap")
    (refused,) = [loss for loss in found.losses if loss.kind == "unusable"]
    assert found.state == "lossy" and refused.where == "/encoder"
    assert "step by -0.4 s, 30" in refused.detail and refused.detail.endswith("a clock was set")


@pytest.mark.parametrize(("by", "said"), [(267 * 365.25 * 86400.0, "97521.8 days after"), (-70.0, "70 s before")])
def test_log_times_far_from_the_stamps_are_told_as_processing_tells_them(tmp_path: Path, by: float, said: str) -> None:
    stamp = np.arange(2000) * 10_000_000 + 10**12
    for name, later in (("a", 0), ("b", int(by * 1e9))):
        angle = np.linspace(0.0, 1.0, 2000)[:, None]
        write_mcap(tmp_path / f"{name}.mcap", [OutStream("/e", "joints", stamp, stamp + later, angle, ("az",))])
    assert not inspect_recording(tmp_path / "a.mcap").losses
    (told,) = inspect_recording(tmp_path / "b.mcap").losses
    assert told.kind == "clocks apart" and said in told.detail
    collected = Collected("/e", ("az",))
    for _, block in open_recording(tmp_path / "b.mcap").read([Stream("e", "/e", ("position[az]",))]):
        collected.push(block)
    collected.finish()
    assert [(loss.kind, loss.detail) for loss in collected.line.losses(0.0, 1.0)] == [(told.kind, told.detail)]


def test_clean(tmp_path: Path) -> None:
    t = np.arange(50) * 10**8
    write_mcap(tmp_path / "a.mcap", [OutStream("/t", "temperature", t, t, np.full((50, 1), 21.5))])
    found = inspect_recording(tmp_path / "a.mcap")
    assert (found.state, found.losses, found.reason) == ("clean", (), "")
    (topic,) = found.topics
    assert topic.rate_Hz == 10


def test_true_and_false_are_no_numbers_and_lose_no_message(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    payload = b'{"locked": true, "temp": 20.5, "flags": [true, false]}'
    path.write_bytes(build([(i, payload) for i in range(30)], ("State", "jsonschema", b"{}"), "json"))
    found = inspect_recording(path)
    (topic,) = found.topics
    assert (found.state, topic.count) == ("clean", 30)
    assert [one.field for one in topic.ranges] == ["temp"]


@pytest.mark.parametrize(
    ("encoding", "schema", "why"),
    [
        ("cdr", ("p/M", "ros2msg", f"float64[{2**70}] x".encode()), "an array of 1180591620717411303... elements"),
        ("cdr", ("p/M", "ros2msg", b"float64[0] x"), "an array of 0 elements"),
        ("cdr", ("p/M", "ros2msg", b"float64 x\nnoise"), "the definition's line 'noise' cannot be read"),
        ("cdr", ("p/M", "ros2msg", b"q/N x"), "the definition of q/N is missing"),
        ("cdr", ("p/M", "ros2msg", b"float64 x:"), "the definition's line 'float64 x:' cannot be read"),
        (
            "cdr",
            (
                "p/M",
                "ros2msg",
                b"builtin_interfaces/Time t\n=\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosek",
            ),
            "builtin_interfaces/Time is not as ROS 2 defines it",
        ),
        (
            "cdr",
            ("p/M", "ros2msg", b"std_msgs/Header h\n=\nMSG: std_msgs/Header\nstring frame_id"),
            "std_msgs/Header is not as ROS 2 defines it",
        ),
        ("cdr", ("p/M", "ros2msg", b"float64 \xff"), "decode byte 0xff"),
        ("protobuf", ("p.M", "protobuf", b"\x0a\xff\xff"), ""),
    ],
)
def test_a_damaged_schema_is_told_and_not_clean(
    tmp_path: Path, encoding: str, schema: tuple[str, str, bytes], why: str
) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(build([(i, bytes(100)) for i in range(30)], schema, encoding))
    found = inspect_recording(path)
    (loss,) = found.losses
    assert (found.state, found.topics[0].count) == ("lossy", 30)
    assert (loss.kind, loss.where, loss.count) == ("unusable", "/topic", 30)
    assert loss.detail.startswith(f"the schema of {schema[0]} is damaged: ") and why in loss.detail


@pytest.mark.slow
def test_topics_of_one_type_share_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What thousands of topics take in memory is what each has of its own."""

    def peak(topics: int) -> int:
        path = tmp_path / f"{topics}.mcap"
        with path.open("wb") as file:
            writer = Writer(file)
            writer.start()
            schema = writer.register_schema("p/M", "ros2msg", b"float64 x\n" + b"float64[3] y\n" * 20)
            for number in range(topics):
                channel = writer.register_channel(f"/t{number}", "cdr", schema)
                writer.add_message(channel, number, b"\0\1\0\0" + bytes(8 * 61), number)
            writer.finish()
        tracemalloc.start()
        assert len(inspect_recording(path).topics) == topics
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most

    peak(10)
    assert (peak(600) - peak(100)) / 500 < 35_000  # bytes a topic; 42,000 where each has its type
    monkeypatch.setattr(inspection, "TOGETHER", 100)
    assert (peak(600) - peak(100)) / 500 < 15_000  # what is kept of a topic's 61 ranges


@pytest.mark.parametrize("together", [1, 2, 3])
def test_topics_read_in_several_passes_are_told_as_in_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, together: int
) -> None:
    stamp, force = np.arange(500) * 10_000_000, np.linspace(0.0, 1.0, 3000).reshape(500, 6)
    force[7, 2] = np.nan
    kept = [np.delete(stamp, slice(40, 60 + i)) for i in range(3)]
    streams = [OutStream(f"/w{i}", "wrench", t, t, force[: len(t)]) for i, t in enumerate(kept)]
    write_mcap(tmp_path / "a.mcap", streams)
    data = (tmp_path / "a.mcap").read_bytes()
    (tmp_path / "a.mcap").write_bytes(data[:-300])
    whole = inspect_recording(tmp_path / "a.mcap")
    monkeypatch.setattr(inspection, "TOGETHER", together)
    parts = inspect_recording(tmp_path / "a.mcap")
    assert whole.state == parts.state == "lossy"
    assert whole.topics == parts.topics and len(whole.topics) == 3
    assert Counter(whole.losses) == Counter(parts.losses)
    assert any(loss.kind == "truncated" for loss in whole.losses)


def test_messages_of_any_type_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(build([(i, bytes(100)) for i in range(30)], ("a/Image", "ros1msg", b""), "ros1"))
    found = inspect_recording(path)
    assert found.state == "clean"
    (topic,) = found.topics
    assert (topic.count, topic.ranges) == (30, ())
    assert "cannot be read" in topic.note
