"""Layouts that change within a file: the fast path must notice, whatever differs."""

from __future__ import annotations

import struct
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap_ros2._dynamic import serialize_dynamic

from kbs_process.errors import RecordingError
from kbs_process.recordings.mcap.messages.schemas import json_schema, protobuf_name, protobuf_schema, ros2_schema
from kbs_process.recordings.mcap.streams import Stream
from recordings.mcap.mcap_files import FORCE, build, read, same_bits

WRENCH = ("geometry_msgs/msg/WrenchStamped", "ros2msg", ros2_schema("wrench"))
JOINTS = ("sensor_msgs/msg/JointState", "ros2msg", ros2_schema("joints"))
ANGLE = Stream("a", "/topic", ("velocity[el]", "position[az]"))
SLOW = settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
NUMBER = st.floats(width=64)
STAMP = st.tuples(st.integers(-(2**31), 2**31 - 1), st.integers(0, 10**9 - 1))


def header(stamp: tuple[int, int], frame: str) -> Any:
    return SimpleNamespace(stamp=SimpleNamespace(sec=stamp[0], nanosec=stamp[1]), frame_id=frame)


def nested(numbers: tuple[float, ...], **others: Any) -> Any:
    parts = [SimpleNamespace(**dict(zip("xyz", numbers[i : i + 3], strict=True))) for i in (0, 3)]
    return SimpleNamespace(wrench=SimpleNamespace(force=parts[0], torque=parts[1]), **others)


def ns(stamp: tuple[int, int]) -> int:
    return stamp[0] * 10**9 + stamp[1]


@SLOW
@given(st.lists(st.tuples(STAMP, st.text(max_size=9), st.tuples(*[NUMBER] * 6)), min_size=1, max_size=60))
def test_frame_ids_of_any_length(tmp_path: Path, rows: list[tuple[Any, str, tuple[float, ...]]]) -> None:
    encode = serialize_dynamic(WRENCH[0], WRENCH[2].decode())[WRENCH[0]]
    payloads = [encode(nested(numbers, header=header(stamp, frame))) for stamp, frame, numbers in rows]
    path = tmp_path / "a.mcap"
    path.write_bytes(build(enumerate(payloads), WRENCH, "cdr", chunk_size=1000))
    block = read(path, Stream("w", "/topic", FORCE))[0]["w"]
    assert same_bits(block.values, np.array([numbers for _, _, numbers in rows]))
    assert block.stamp.tolist() == [ns(stamp) for stamp, _, _ in rows]


JOINT_ROW = st.tuples(
    st.permutations(["az", "el", "spare"]), st.text("ab", max_size=3), st.tuples(*[NUMBER] * 3), st.booleans()
)


@SLOW
@given(st.lists(JOINT_ROW, min_size=1, max_size=60))
def test_names_in_any_order(tmp_path: Path, rows: list[tuple[list[str], str, tuple[float, ...], bool]]) -> None:
    encode = serialize_dynamic(JOINTS[0], JOINTS[2].decode())[JOINTS[0]]
    payloads, expected = [], []
    for names, frame, numbers, moving in rows:
        velocity = [-number for number in numbers] if moving else []
        message = SimpleNamespace(
            header=header((5, 6), frame), name=names, position=list(numbers), velocity=velocity, effort=[]
        )
        payloads.append(encode(message))
        el = names.index("el")
        expected.append((velocity[el] if moving else np.nan, numbers[names.index("az")]))
    path = tmp_path / "a.mcap"
    path.write_bytes(build(enumerate(payloads), JOINTS, "cdr", chunk_size=1000))
    blocks, losses = read(path, ANGLE)
    assert np.array_equal(blocks["a"].values, np.array(expected), equal_nan=True)
    lacking = sum(loss.count for loss in losses if loss.kind == "missing field")
    assert lacking == sum(not moving for *_, moving in rows)


def protobuf_class(name: str, data: bytes) -> Any:
    pool = descriptor_pool.DescriptorPool()
    for entry in descriptor_pb2.FileDescriptorSet.FromString(data).file:
        pool.Add(entry)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(name))


@SLOW
@given(
    st.lists(
        st.tuples(STAMP, st.text(max_size=4), st.tuples(*[st.sampled_from([0.0, -0.0, 1.5, 1e300])] * 6)),
        min_size=1,
        max_size=80,
    )
)
def test_protobuf_leaves_out_zeros(tmp_path: Path, rows: list[tuple[Any, str, tuple[float, ...]]]) -> None:
    schema = (protobuf_name("wrench"), "protobuf", protobuf_schema())
    kind = protobuf_class(schema[0], schema[2])
    payloads = []
    for (seconds, nanoseconds), frame, numbers in rows:
        message = kind()
        message.header.stamp.sec, message.header.stamp.nanosec = seconds, nanoseconds
        message.header.frame_id = frame
        for number, path in zip(numbers, FORCE, strict=True):
            _, part, axis = path.split(".")
            setattr(getattr(message.wrench, part), axis, number)
        payloads.append(message.SerializeToString())
    path = tmp_path / "a.mcap"
    path.write_bytes(build(enumerate(payloads), schema, "protobuf", chunk_size=1000))
    block = read(path, Stream("w", "/topic", FORCE))[0]["w"]
    assert same_bits(block.values, np.array([numbers for _, _, numbers in rows]))
    assert block.stamp.tolist() == [ns(stamp) for stamp, _, _ in rows]


def test_protobuf_numbers_of_every_type(tmp_path: Path) -> None:
    """All scalar types, packed and single, against the protobuf library."""
    kinds = [t for t in range(1, 19) if t not in (9, 10, 11, 12)]
    file = descriptor_pb2.FileDescriptorProto(name="t.proto", package="p", syntax="proto3")
    message = file.message_type.add(name="All")
    for number, kind in enumerate(kinds, start=1):
        extra = {"type_name": ".p.Colour"} if kind == 14 else {}
        message.field.add(name=f"s{kind}", number=number, type=kind, label=1, **extra)
        message.field.add(name=f"r{kind}", number=100 + number, type=kind, label=3, **extra)
    enum = file.enum_type.add(name="Colour")
    for value in (0, 1):
        enum.value.add(name=f"C{value}", number=value)
    schema = ("p.All", "protobuf", descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString())
    cls = protobuf_class(schema[0], schema[2])
    rng = np.random.default_rng(5)
    signed, floating = {3, 5, 15, 16, 17, 18}, {1, 2}
    payloads, expected = [], []
    for _ in range(50):
        one, row = cls(), []
        for kind in kinds:
            values = [float(np.float32(v)) for v in rng.normal(size=3)] if kind in floating else []
            values = values or [int(v) for v in rng.integers(-(2**31) if kind in signed else 0, 2**31, 3)]
            values = [int(v > 2**30) for v in values] if kind in (8, 14) else values
            setattr(one, f"s{kind}", values[0])
            getattr(one, f"r{kind}").extend(values)
            row += [values[0], values[2]]
        payloads.append(one.SerializeToString())
        expected.append(row)
    path = tmp_path / "a.mcap"
    path.write_bytes(build(enumerate(payloads), schema, "protobuf"))
    fields = tuple(field for kind in kinds for field in (f"s{kind}", f"r{kind}[2]"))
    block = read(path, Stream("x", "/topic", fields))[0]["x"]
    assert np.array_equal(block.values, np.array(expected, dtype=float))


SCHEMA = """# Every primitive, arrays, sequences, constants, defaults and nesting
int8 LIMIT=7
string NAME = "a # b"
bool flag
byte b
char c
int8 i1
uint8 u1
int16 i2
uint16 u2
int32 i4
uint32 u4
int64 i8
uint64 u8
float32 f4
float64 f8 0.5
string<=5 label
float32[3] fixed
int16[] open
float64[<=4] bounded
Inner inner
Inner[] many
geometry_msgs/Vector3 last
================================================================================
MSG: test_msgs/Inner
string[] words
uint8 tail
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
"""


def test_cdr_numbers_of_every_type(tmp_path: Path) -> None:
    """All primitive types at all alignments, against mcap-ros2-support."""
    schema = ("test_msgs/msg/All", "ros2msg", SCHEMA.encode())
    encode = serialize_dynamic(schema[0], SCHEMA)[schema[0]]
    rng = np.random.default_rng(7)
    whole = {f"{s}{n}": (s, n) for s in "iu" for n in (1, 2, 4, 8)}
    payloads, expected = [], []
    for _ in range(80):
        numbers: dict[str, Any] = {"flag": bool(rng.integers(2)), "b": 7, "c": 8, "f4": 0.25, "f8": rng.normal()}
        for name, (sign, size) in whole.items():
            bits = min(8 * size, 50) - 1
            numbers[name] = int(rng.integers(-(2**bits) if sign == "i" else 0, 2**bits))
        inner = [
            SimpleNamespace(words=["w" * int(k) for k in rng.integers(0, 4, 2)], tail=int(rng.integers(256)))
            for _ in range(int(rng.integers(1, 4)))
        ]
        fixed, bounded = [1.5, 2.5, float(rng.integers(9))], list(rng.normal(size=int(rng.integers(2, 5))))
        last = rng.normal(size=3)
        message = SimpleNamespace(
            **numbers,
            label="x" * int(rng.integers(6)),
            fixed=fixed,
            open=[int(v) for v in rng.integers(-99, 99, int(rng.integers(1, 6)))],
            bounded=bounded,
            inner=inner[0],
            many=inner[1:],
            last=SimpleNamespace(**dict(zip("xyz", last, strict=True))),
        )
        payloads.append(encode(message))
        tail = [fixed[2], message.open[0], bounded[1], inner[0].tail, last[2]]
        expected.append([*(float(value) for value in numbers.values()), *tail])
    path = tmp_path / "a.mcap"
    path.write_bytes(build(enumerate(payloads), schema, "cdr", chunk_size=3000))
    fields = (*numbers, "fixed[2]", "open[0]", "bounded[1]", "inner.tail", "last.z")
    blocks, losses = read(path, Stream("x", "/topic", fields))
    assert same_bits(blocks["x"].values, np.array(expected))
    assert losses == ()
    assert blocks["x"].stamp.tolist() == blocks["x"].log.tolist()  # without a header, the recorder's clock


def test_big_endian(tmp_path: Path) -> None:
    numbers = np.random.default_rng(2).normal(size=(20, 6))
    payloads = [
        b"\0\0\0\0" + struct.pack(">iII4s6d", 7, 8, 4, b"abc\0", *row)
        if i % 3
        else b"\0\1\0\0" + struct.pack("<iII4s6d", 7, 8, 4, b"abc\0", *row)
        for i, row in enumerate(numbers)
    ]
    path = tmp_path / "a.mcap"
    path.write_bytes(build(enumerate(payloads), WRENCH, "cdr"))
    block = read(path, Stream("w", "/topic", FORCE))[0]["w"]
    assert same_bits(block.values, numbers)
    assert set(block.stamp.tolist()) == {7_000_000_008}


def test_small_messages_at_the_end_of_a_chunk(tmp_path: Path) -> None:
    schema = ("std_msgs/msg/Int8", "ros2msg", b"int8 data")
    payloads = [b"\0\1\0\0" + struct.pack("b", i - 50) for i in range(100)]
    for options in ({}, {"use_chunking": False}, {"chunk_size": 1}):
        path = tmp_path / "a.mcap"
        path.write_bytes(build(enumerate(payloads), schema, "cdr", **options))
        block = read(path, Stream("x", "/topic", ("data",)))[0]["x"]
        assert block.values[:, 0].tolist() == list(range(-50, 50))


def test_undecodable_messages_are_counted_and_passed_over(tmp_path: Path) -> None:
    good = b"\0\1\0\0" + struct.pack("<iII4s6d", 7, 8, 4, b"abc\0", *range(6))
    huge = b"\0\1\0\0" + struct.pack("<iII", 7, 8, 0xFFFFFFFF) + bytes(52)
    for bad in (good[:-1], good[:9], b"", b"\0\2\0\0" + good[4:], huge):
        path = tmp_path / "a.mcap"
        path.write_bytes(build(enumerate([bad, good, bad, good]), WRENCH, "cdr"))
        blocks, losses = read(path, Stream("w", "/topic", FORCE))
        assert blocks["w"].log.tolist() == [1, 3]
        assert blocks["w"].values.tolist() == [[0, 1, 2, 3, 4, 5]] * 2
        assert [(loss.kind, loss.count) for loss in losses] == [("undecodable", 2)]


def test_json_in_odd_shapes(tmp_path: Path) -> None:
    schema = ("WrenchStamped", "jsonschema", json_schema("wrench"))
    payloads = [
        b'{"wrench": {"force": {"x": 0.1, "y": 1e-320, "z": 3}}, "header": {"stamp": {"sec": 1, "nsec": 5}}}',
        b'\n { "header":{"stamp":{"nsec":6,"sec":1},"x":[{}]}, "wrench":{"force":{"z":null,"x":-0.0,"y":2.5}}}\n',
        b'{"header": {"stamp": {"sec": 1, "nsec": 7}}, "wrench": {"force": {"x": "1"}}}',
        b'{"header": {"stamp": {"sec": 1, "nsec": 7}}, "wrench": {"force": {"x": 1',
        b'{"header": {"stamp": {"sec": 1, "nsec": 8}}, "wrench": {}}',
        b'{"header": {"stamp": {"sec": 99999999999999999999, "nsec": 8}}}',
        b"[" * 100_000,
    ]
    path = tmp_path / "a.mcap"
    path.write_bytes(build(enumerate(payloads), schema, "json"))
    blocks, losses = read(path, Stream("w", "/topic", FORCE[:3]))
    nan = np.nan
    expected = np.array([[0.1, 1e-320, 3.0], [-0.0, 2.5, nan], [nan, nan, nan]])
    assert np.array_equal(blocks["w"].values, expected, equal_nan=True)
    assert np.signbit(blocks["w"].values[1, 0])
    assert blocks["w"].stamp.tolist() == [1_000_000_005, 1_000_000_006, 1_000_000_008]
    assert {loss.kind: loss.count for loss in losses} == {"missing field": 2, "undecodable": 4}


@pytest.mark.parametrize(
    ("schema", "encoding", "word"),
    [
        (("a/msg/B", "ros2idl", b""), "cdr", "cannot be read"),
        (("a/msg/B", "ros2msg", b"C c"), "cdr", "definition of C is missing"),
        (("a/msg/B", "ros2msg", b"B b"), "cdr", "contains itself"),
        (("a/msg/B", "ros2msg", b"\xff\xfe"), "cdr", "damaged"),
        (("a.B", "protobuf", b"\x0a\xff"), "protobuf", "damaged"),
        (("a.B", "protobuf", b""), "protobuf", "descriptor of a.B is missing"),
        (("a/B", "ros1msg", b""), "ros1", "cannot be read"),
    ],
)
def test_schemas_that_cannot_be_used(tmp_path: Path, schema: tuple[str, str, bytes], encoding: str, word: str) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(build([(0, b"\0\1\0\0")], schema, encoding))
    with pytest.raises(RecordingError, match=word):
        read(path, Stream("x", "/topic", ("x",)))


def test_nesting_that_doubles_is_refused_at_once(tmp_path: Path) -> None:
    text = "L0 a\nL0 b\n" + "".join(f"===\nMSG: p/L{i}\nL{i + 1} a\nL{i + 1} b\n" for i in range(60))
    path = tmp_path / "a.mcap"
    schema = ("p/msg/Top", "ros2msg", (text + "===\nMSG: p/L60\nint8 x\n").encode())
    path.write_bytes(build([(0, b"\0\1\0\0")], schema, "cdr"))
    with pytest.raises(RecordingError, match="too much"):
        read(path, Stream("x", "/topic", ("x",)))
