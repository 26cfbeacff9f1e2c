"""Files that keep to the format in odd ways, or in none: each is read right, or told; none is a fault."""

from __future__ import annotations

import io
import struct
import time
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
from mcap.writer import CompressionType, Writer

from kbs_process.recordings.mcap.messages.encoding import OutStream
from kbs_process.recordings.mcap.streams import Stream
from kbs_process.recordings.mcap.writer import write_mcap
from kbs_process.reduction.inspection import inspect_recording
from recordings.mcap.mcap_files import MAGIC, build, read
from recordings.mcap.test_mcap_damage import chunk, hostile, record

JOINTS = ("p/M", "ros2msg", b"string[] name\nfloat64[] position")
STAMPED = ("p/M", "ros2msg", b"builtin_interfaces/Time stamp\nfloat64 x")


def joints(*names: str) -> bytes:
    """Return a message that gives a joint the position of its place."""
    data = struct.pack("<I", len(names))
    for name in names:
        data += b"\0" * (-len(data) % 4) + struct.pack("<I", len(name) + 1) + name.encode() + b"\0"
    data += b"\0" * (-len(data) % 4) + struct.pack("<I", len(names))
    data += b"\0" * (-len(data) % 8) if names else b""
    return b"\0\1\0\0" + data + struct.pack(f"<{len(names)}d", *range(len(names)))


def put(path: Path, payloads: list[bytes], schema: tuple[str, str, bytes], encoding: str = "cdr") -> Path:
    path.write_bytes(build([(10**7 * i, payload) for i, payload in enumerate(payloads)], schema, encoding))
    return path


@pytest.mark.parametrize(
    "key", ["__init__", "__slots__", "__dict__", "__getattribute__", "__new__", "__module__", "class", "at_a", "f0"]
)
def test_json_keys_that_mean_something_to_python(tmp_path: Path, key: str) -> None:
    payload = f'{{"{key}": 1.5, "o": {{"{key}": 2.5, "{key}s": [3.5]}}}}'.encode()
    path = put(tmp_path / "a.mcap", [payload] * 3, ("x", "jsonschema", b"{}"), "json")
    found = inspect_recording(path)
    assert found.state == "clean"
    assert [(one.field, one.low) for one in found.topics[0].ranges] == [
        (key, 1.5),
        (f"o.{key}", 2.5),
        (f"o.{key}s[0]", 3.5),
    ]
    blocks, _ = read(path, Stream("s", "/topic", (f"o.{key}",)))
    assert blocks["s"].values[:, 0].tolist() == [2.5] * 3


@pytest.mark.parametrize("odd", ["null", "7", "[1]", '[{"b": 1}]', '"text"'])
def test_json_that_changes_its_shape(tmp_path: Path, odd: str) -> None:
    payloads = [f'{{"a": {odd}, "c": 1}}'.encode(), *[b'{"a": {"b": 2}, "c": 3}'] * 3]
    found = inspect_recording(put(tmp_path / "a.mcap", payloads, ("x", "jsonschema", b"{}"), "json"))
    assert (found.state, found.losses[0].kind, found.losses[0].count) == ("lossy", "undecodable", 1)
    assert {one.field: one.high for one in found.topics[0].ranges} == {"a.b": 2, "c": 3}


def test_json_names_that_are_numbers_name_nothing(tmp_path: Path) -> None:
    payloads = [b'{"name": [1, 2], "position": [3, 4]}', b'{"name": {"x": 1}, "position": [3, 4]}'] * 2
    found = inspect_recording(put(tmp_path / "a.mcap", payloads, ("x", "jsonschema", b"{}"), "json"))
    assert found.topics[0].names == ()


CHAIN = "\n".join(["p/A1 x", *(f"===\nMSG: p/A{i}\np/A{i + 1} x" for i in range(1, 900)), "===\nMSG: p/A900\nint8 z"])


@pytest.mark.parametrize(
    ("text", "word"),
    [
        (f"float64[{2**70}] x", "array"),
        (f"float64[{'9' * 5000}] x", "array"),
        ("float64 z\np/E[1000000000000] x\n===\nMSG: p/E\nfloat64[0] y", "0 elements"),
        ("p/E[1000000000000] x\n===\nMSG: p/E\nfloat64 y", ""),
        ("p/E[1000000000000] x\n===\nMSG: p/E", ""),
        ("string[1000000000000] x", ""),
        ("float64[1000000000000] x", "too early"),
        (CHAIN, "too much"),
    ],
)
def test_schemas_that_ask_for_more_than_there_is(tmp_path: Path, text: str, word: str) -> None:
    path = put(tmp_path / "a.mcap", [b"\0\1\0\0" + bytes(8)] * 3, ("p/M", "ros2msg", text.encode()))
    begun = time.process_time()
    found = inspect_recording(path)
    assert time.process_time() - begun < 20  # s, where what is asked for would take hours
    assert word in found.topics[0].note
    assert word or found.state == "clean"  # there is no number in it that one could ask for


@pytest.mark.parametrize("first", [b"", b"\x28\xb5\x2f\xfd....", b"\0\7\0\0" + bytes(8), b"\0\1\0\0" + b"\xff" * 8])
def test_a_damaged_first_message_hides_no_other(tmp_path: Path, first: bytes) -> None:
    found = inspect_recording(put(tmp_path / "a.mcap", [first, *[joints("az", "el")] * 9], JOINTS))
    assert (found.state, found.topics[0].names) == ("lossy", ("az", "el"))
    assert [(one.field, one.high) for one in found.topics[0].ranges] == [("position[az]", 0), ("position[el]", 1)]
    assert [(loss.kind, loss.count) for loss in found.losses] == [("undecodable", 1)]


def test_a_first_message_without_joints_hides_none(tmp_path: Path) -> None:
    path = put(tmp_path / "a.mcap", [joints(), *[joints("az")] * 9], JOINTS)
    assert [one.field for one in inspect_recording(path).topics[0].ranges] == ["position[az]"]


def test_messages_compressed_one_by_one_are_named(tmp_path: Path) -> None:
    path = put(tmp_path / "a.mcap", [b"\x28\xb5\x2f\xfd" + bytes(9)] * 9, STAMPED)
    (loss,) = inspect_recording(path).losses
    assert (loss.count, "--compression-mode message" in loss.detail) == (9, True)


@pytest.mark.parametrize("encoding", ["cdr", "json"])
def test_nanoseconds_beyond_a_second_are_no_stamp(tmp_path: Path, encoding: str) -> None:
    stamps = [(5, 0), (5, 10**9), (5, 2**32 - 1), (6, 999_999_999)]
    if encoding == "cdr":
        payloads = [b"\0\1\0\0" + struct.pack("<iId", *stamp, 1.0) for stamp in stamps]
    else:
        payloads = [f'{{"stamp": {{"sec": {sec}, "nanosec": {ns}}}, "x": 1.0}}'.encode() for sec, ns in stamps]
    path = put(tmp_path / "a.mcap", payloads, STAMPED, encoding)
    blocks, losses = read(path, Stream("s", "/topic", ("x",)))
    assert blocks["s"].stamp.tolist() == [5 * 10**9, 7 * 10**9 - 1]
    assert [(loss.kind, loss.count) for loss in losses] == [("no valid stamp", 2)]


def padded(data: bytes, padded_opcode: int) -> bytes:
    """Return a file's records with bytes behind the known fields of one kind, as later versions may write."""
    out, at = bytearray(MAGIC), len(MAGIC)
    while at < len(data) - len(MAGIC):
        opcode, length = struct.unpack_from("<BQ", data, at)
        content = data[at + 9 : at + 9 + length]
        out += record(opcode, content + (b"\1\2\3" if opcode == padded_opcode else b""))
        at += 9 + length
    return bytes(out) + MAGIC


@pytest.mark.parametrize("opcode", [1, 6, 7, 8, 9, 10, 12, 15])
def test_fields_of_later_versions_are_passed_over(tmp_path: Path, opcode: int) -> None:
    out = io.BytesIO()
    writer = Writer(out, chunk_size=200, enable_crcs=False)
    writer.start()
    channel = writer.register_channel("/topic", "cdr", writer.register_schema("p/M", "ros2msg", b"float64 x"))
    writer.add_attachment(0, 0, "a", "b", b"content")
    writer.add_metadata("m", {"k": "v"})
    for i in range(30):
        writer.add_message(channel, i, b"\0\1\0\0" + struct.pack("<d", i), i, i)
    writer.finish()
    # Without its footer's offsets, which would have to move.
    data = out.getvalue()
    end = data.rindex(record(2, b"")[:1] + struct.pack("<Q", 20))
    path = tmp_path / "a.mcap"
    path.write_bytes(padded(data[:end], opcode)[: -len(MAGIC)] + record(2, bytes(20)) + MAGIC)
    found = inspect_recording(path)
    assert (found.state, found.losses, found.topics[0].count) == ("clean", (), 30)


def test_lz4_frames_that_follow_one_another(tmp_path: Path) -> None:
    schema = record(3, b"\1\0" + b"".join(struct.pack("<I", len(t)) + t for t in (b"p/M", b"ros2msg", b"float64 x")))
    channel = record(4, b"\1\0\1\0" + b"".join(struct.pack("<I", len(t)) + t for t in (b"/t", b"cdr")) + bytes(4))
    message = record(5, struct.pack("<HIQQ", 1, 0, 5, 5) + b"\0\1\0\0" + struct.pack("<d", 2.5))
    parts = [schema + channel, message]
    frames = b"".join(map(lz4.frame.compress, parts))
    path = tmp_path / "a.mcap"
    path.write_bytes(hostile(chunk("lz4", sum(map(len, parts)), frames)))
    blocks, _ = read(path, Stream("s", "/t", ("x",)))
    assert blocks["s"].values.tolist() == [[2.5]]


def test_work_and_memory_follow_the_messages_not_channels_squared(tmp_path: Path) -> None:
    out = io.BytesIO()
    writer = Writer(out, compression=CompressionType.NONE, chunk_size=1)
    writer.start()
    schema = writer.register_schema("p/M", "ros2msg", b"float64 x")
    for i in range(500):
        channel = writer.register_channel("/t", "cdr", schema)
        writer.add_message(channel, i, b"\0\1\0\0" + struct.pack("<d", i), i, i)
    writer.finish()
    path = tmp_path / "a.mcap"
    path.write_bytes(out.getvalue())
    begun = time.process_time()
    blocks, losses = read(path, Stream("s", "/t", ("x",)))
    assert blocks["s"].values[:, 0].tolist() == list(range(500))
    assert not losses
    assert time.process_time() - begun < 20


def test_the_gaps_of_many_topics_take_no_room(tmp_path: Path) -> None:
    stamp = 10**7 * np.arange(100)
    path = tmp_path / "a.mcap"
    write_mcap(path, [OutStream(f"/t{i}", "temperature", stamp, stamp, np.ones((100, 1))) for i in range(3)])
    assert [one.rate_Hz for one in inspect_recording(path).topics] == [100] * 3


@pytest.mark.parametrize(
    ("start", "why"), [(b"\0\7\0\0", "XCDR2"), (b"\x28\xb5\x2f\xfd", "compression-mode"), (b"abcd", "no plain CDR")]
)
def test_a_topic_of_sequences_that_cannot_be_decoded_is_told(tmp_path: Path, start: bytes, why: str) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(build([(10**7 * i, start + bytes(32)) for i in range(100)], JOINTS, "cdr"))
    inspection = inspect_recording(path)
    (topic,), (loss,) = inspection.topics, inspection.losses
    assert inspection.state == "lossy"
    assert loss.count == topic.count == 100
    assert why in loss.detail
    assert why in topic.note
    assert not topic.ranges


def test_json_that_is_no_utf8_is_lost_as_one_message(tmp_path: Path) -> None:
    good = b'{"a": 1.5}'
    path = put(
        tmp_path / "a.mcap", [good, b'{"\xd1\x00": 2}', b'{"a": "\xff"}', good], ("x", "jsonschema", b"{}"), "json"
    )
    blocks, losses = read(path, Stream("s", "/topic", ("a",)))
    assert blocks["s"].values[:, 0].tolist() == [1.5, 1.5]
    assert [(loss.kind, loss.count) for loss in losses] == [("undecodable", 2)]


def test_a_message_whose_end_nothing_confirms_is_not_read(tmp_path: Path) -> None:
    """Eight bytes too many in a message of a chunk without a checksum: what follows is no record."""
    payloads = [b"\0\1\0\0" + struct.pack("<IId", i, 0, float(i)) for i in range(1, 9)]
    data = build(
        [(10**9 * i, payload) for i, payload in enumerate(payloads, 1)],
        STAMPED,
        "cdr",
        compression=CompressionType.NONE,
        enable_crcs=False,
        enable_data_crcs=False,
    )
    inside = data.index(payloads[4]) + 14  # within the number of the fifth
    path = tmp_path / "a.mcap"
    path.write_bytes(data[:inside] + bytes(8) + data[inside:])
    blocks, losses = read(path, Stream("s", "/topic", ("x",)))
    assert blocks["s"].values[:, 0].tolist() == [1.0, 2.0, 3.0, 4.0]
    assert any("are no records" in loss.detail for loss in losses)


HEADER = "\n=\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id"


def test_the_stamp_is_a_header_s_by_whatever_name(tmp_path: Path) -> None:
    schema = ("p/M", "ros2msg", f"std_msgs/Header hdr\nfloat64 x{HEADER}".encode())
    payload = b"\0\1\0\0" + struct.pack("<iII", 5, 7, 1) + bytes(4) + struct.pack("<d", 2.5)
    blocks, losses = read(put(tmp_path / "a.mcap", [payload], schema), Stream("x", "/topic", ("x",)))
    assert (blocks["x"].stamp.tolist(), blocks["x"].values.tolist(), losses) == ([5_000_000_007], [[2.5]], ())


def test_a_payload_that_goes_on_behind_its_schema_is_undecodable(tmp_path: Path) -> None:
    schema = ("p/M", "ros2msg", b"float64 x")
    whole = b"\0\1\0\0" + struct.pack("<d", 2.5)
    padded, more = whole + bytes(4), whole + bytes(8)
    blocks, losses = read(put(tmp_path / "a.mcap", [whole, padded, more], schema), Stream("x", "/topic", ("x",)))
    (loss,) = losses
    assert blocks["x"].values.tolist() == [[2.5], [2.5]]
    assert loss.count == 1 and "goes on for 8 bytes that its schema does not have" in loss.detail
