"""What is written is read back, by the reader and by the field's own libraries."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType
from mcap_ros2.decoder import DecoderFactory

from kbs_process.errors import OutputError, RecordingError
from kbs_process.recordings.mcap.messages.encoding import Encoding, OutStream
from kbs_process.recordings.mcap.source import open_recording
from kbs_process.recordings.mcap.streams import Stream
from kbs_process.recordings.mcap.writer import write_mcap
from recordings.mcap.mcap_files import FORCE, read, rewrite, same_bits

ENCODINGS: tuple[Encoding, ...] = ("ros2", "json", "protobuf")
ANGLE = ("position[az]", "position[el]", "velocity[az]", "velocity[el]")
STREAMS = (
    Stream("wrench", "/wrench", FORCE),
    Stream("angle", "/encoder", ANGLE),
    Stream("temperature", "/temperature", ("temperature",)),
)


def campaign(encoding: Encoding = "ros2", n: int = 3000) -> list[OutStream]:
    """Three topics with rates and clocks of their own, and numbers that are hard to print and to encode."""
    rng = np.random.default_rng(1996)
    stamp = 1_700_000_000_000_000_000 + 1_000_000 * np.arange(n)
    wrench = rng.normal(size=(n, 6)) * 10.0 ** rng.integers(-300, 300, size=(n, 6))
    wrench[rng.random(wrench.shape) < 0.2] = 0.0
    wrench[rng.random(wrench.shape) < 0.1] = -0.0
    joints = rng.normal(size=(n // 10, 4))
    joints[::7] = 0.0
    slow = stamp[: n // 10] * 1 + 9_000_000 * np.arange(n // 10)
    return [
        OutStream("/wrench", "wrench", stamp, stamp + 321, wrench, (), encoding, "transducer"),
        OutStream("/encoder", "joints", slow + 17, slow + 5_000, joints, ("az", "el"), encoding),
        OutStream("/temperature", "temperature", slow[:30], slow[:30] + 10**9, joints[:30, :1], (), encoding),
    ]


def check(path: Path, written: list[OutStream]) -> None:
    blocks, losses = read(path, *STREAMS)
    assert losses == ()
    for key, stream in zip(("wrench", "angle", "temperature"), written, strict=True):
        assert np.array_equal(blocks[key].stamp, stream.stamp)
        assert np.array_equal(blocks[key].log, stream.log)
        assert same_bits(blocks[key].values, stream.values)


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("compression", list(CompressionType))
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"chunk_size": 2000},
        {"use_chunking": False},
        {"index_types": IndexType.NONE, "repeat_channels": False, "use_statistics": False},
        {"enable_crcs": False, "use_summary_offsets": False, "repeat_schemas": False},
        {"enable_data_crcs": True, "chunk_size": 50_000},
    ],
    ids=["default", "small chunks", "no chunks", "no index", "no CRC", "data CRC"],
)
def test_every_encoding_and_container(
    tmp_path: Path, encoding: Encoding, compression: CompressionType, options: dict[str, Any]
) -> None:
    written = campaign(encoding, 600)
    write_mcap(tmp_path / "a.mcap", written)
    rewrite(tmp_path / "a.mcap", tmp_path / "b.mcap", compression=compression, **options)
    check(tmp_path / "a.mcap", written)
    check(tmp_path / "b.mcap", written)


def test_ros2_support_reads_the_same_numbers(tmp_path: Path) -> None:
    written = campaign()
    write_mcap(tmp_path / "a.mcap", written)
    wrench, angle, temperature = [], [], []
    with (tmp_path / "a.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        header = reader.get_header()
        for _, channel, message, ros in reader.iter_decoded_messages():
            stamp = ros.header.stamp.sec * 10**9 + ros.header.stamp.nanosec
            if channel.topic == "/wrench":
                force, torque = ros.wrench.force, ros.wrench.torque
                wrench.append((force.x, force.y, force.z, torque.x, torque.y, torque.z))
                assert ros.header.frame_id == "transducer"
            elif channel.topic == "/encoder":
                assert list(ros.name) == ["az", "el"]
                angle.append((*ros.position, *ros.velocity))
            else:
                temperature.append((ros.temperature,))
            assert stamp == message.publish_time
    assert header.profile == "ros2"
    for numbers, stream in zip((wrench, angle, temperature), written, strict=True):
        assert same_bits(np.array(numbers), stream.values)


def test_protobuf_library_reads_the_same_numbers(tmp_path: Path) -> None:
    written = campaign("protobuf", 200)
    write_mcap(tmp_path / "a.mcap", written)
    rows = []
    with (tmp_path / "a.mcap").open("rb") as file:
        for schema, _, message in make_reader(file).iter_messages(topics="/wrench"):
            pool = descriptor_pool.DescriptorPool()
            for entry in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
                pool.Add(entry)
            kind = message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name))
            wrench = kind.FromString(message.data).wrench
            rows.append([getattr(part, axis) for part in (wrench.force, wrench.torque) for axis in "xyz"])
    assert same_bits(np.array(rows), written[0].values)


def test_the_same_streams_give_the_same_bytes(tmp_path: Path) -> None:
    write_mcap(tmp_path / "a.mcap", campaign())
    write_mcap(tmp_path / "b.mcap", campaign())
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


def test_messages_lie_in_the_order_of_log_times(tmp_path: Path) -> None:
    stream = campaign(n=500)[0]
    order = np.random.default_rng(3).permutation(500)
    shuffled = OutStream("/wrench", "wrench", stream.stamp[order], stream.log[order], stream.values[order])
    write_mcap(tmp_path / "a.mcap", [shuffled, campaign(n=500)[1]])
    with (tmp_path / "a.mcap").open("rb") as file:
        logs = [m.log_time for _, _, m in make_reader(file).iter_messages(log_time_order=False)]
    assert logs == sorted(logs)
    assert np.array_equal(read(tmp_path / "a.mcap", STREAMS[0])[0]["wrench"].stamp, stream.stamp)


def test_what_does_not_read_back_is_not_called_written(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    write_mcap(path, campaign(n=50))
    before = path.read_bytes()
    infinite = OutStream("/w", "wrench", np.arange(3), np.arange(3), np.full((3, 6), np.inf), encoding="json")
    with pytest.raises(OutputError, match="does not read back"):  # JSON has no infinity
        write_mcap(path, [infinite])
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.mcap"]
    with pytest.raises(OutputError, match="cannot be written"):
        write_mcap(tmp_path / "missing" / "a.mcap", campaign(n=50))


def test_not_a_number_passes_and_is_counted(tmp_path: Path) -> None:
    for encoding in ENCODINGS:
        values = np.ones((100, 6))
        values[40:43, 2] = np.nan
        stamp = np.arange(100) * 10**9
        stream = OutStream("/wrench", "wrench", stamp, stamp, values, encoding=encoding)
        write_mcap(tmp_path / "a.mcap", [stream])
        blocks, losses = read(tmp_path / "a.mcap", STREAMS[0])
        assert np.array_equal(blocks["wrench"].values, values, equal_nan=True)
        assert sum(loss.count for loss in losses) == 3
        assert (losses[0].start_s, losses[0].end_s) == (40.0, 42.0)


def test_position_alone(tmp_path: Path) -> None:
    stamp = np.arange(10)
    for encoding in ENCODINGS:
        stream = OutStream("/encoder", "joints", stamp, stamp, np.ones((10, 2)), ("az", "el"), encoding)
        write_mcap(tmp_path / "a.mcap", [stream])
        blocks, losses = read(tmp_path / "a.mcap", STREAMS[1])
        assert np.array_equal(blocks["angle"].values[:, :2], np.ones((10, 2)))
        assert np.isnan(blocks["angle"].values[:, 2:]).all()
        assert [(loss.kind, loss.count) for loss in losses] == [("missing field", 10)]


def test_blocks_are_pieces_not_the_whole_file(tmp_path: Path) -> None:
    write_mcap(tmp_path / "a.mcap", campaign(n=40_000))
    source = open_recording(tmp_path / "a.mcap")
    lengths = [len(block) for key, block in source.read(STREAMS) if key == "wrench"]
    assert sum(lengths) == 40_000
    assert max(lengths) < 15_000


@pytest.mark.parametrize(
    ("stream", "words"),
    [
        (Stream("w", "/wrensh", FORCE), ("no topic '/wrensh'", "did you mean '/wrench'", "/encoder")),
        (Stream("w", "/wrench", ("wrench.forces.x",)), ("wrench.forces.x", "did you mean 'wrench.force.x'", "a.mcap")),
        (Stream("w", "/encoder", FORCE), ("no number 'wrench.force.x'", "/encoder", "JointState")),
        (Stream("w", "/encoder", ("position[as]",)), ("'as' of position", "known: az, el")),
        (Stream("w", "/encoder", ("position",)), ("no number 'position'", "position[NAME]")),
        (Stream("w", "/wrench", ("wrench.force.x[0]",)), ("no number",)),
        (Stream("w", "/wrench", ("wrench..x",)), ("no field path",)),
    ],
)
@pytest.mark.parametrize("encoding", ENCODINGS)
def test_what_is_not_there_is_named(tmp_path: Path, encoding: Encoding, stream: Stream, words: tuple[str, ...]) -> None:
    write_mcap(tmp_path / "a.mcap", campaign(encoding, 50))
    with pytest.raises(RecordingError) as error:
        read(tmp_path / "a.mcap", stream)
    for word in words:
        assert word in str(error.value)


def test_topics(tmp_path: Path) -> None:
    write_mcap(tmp_path / "a.mcap", campaign(n=100))
    rewrite(
        tmp_path / "a.mcap",
        tmp_path / "b.mcap",
        compression=CompressionType.ZSTD,
        index_types=IndexType.NONE,
        repeat_channels=False,
        use_statistics=False,
    )
    topics = open_recording(tmp_path / "a.mcap").topics
    assert topics == open_recording(tmp_path / "b.mcap").topics
    assert [(t.topic, t.type, t.encoding, t.count) for t in topics] == [
        ("/encoder", "sensor_msgs/msg/JointState", "cdr", 10),
        ("/temperature", "sensor_msgs/msg/Temperature", "cdr", 10),
        ("/wrench", "geometry_msgs/msg/WrenchStamped", "cdr", 100),
    ]
