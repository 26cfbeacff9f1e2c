"""An accelerometer and a gyro of a recording: read, held against the motion, and named where they are otherwise."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.writer import Writer

from campaign.campaign_folder import CampaignFolder
from end_to_end.short_campaign import short_campaign
from kbs_process.campaign.load import load_campaign
from kbs_process.progress import SilentProgress
from kbs_process.signals.records import Array
from kbs_process.studies.correlate.run import process

pytestmark = pytest.mark.slow

G, PLACE = 9.80665, np.array([0.25, 0.1, 0.4])  # m from the elevation axis
NOISE = {"accelerometer": 1e-3, "gyro": 1e-5}
DESCRIBED = """
[accelerometer]
on = "el"
position = {{ value = [0.25, 0.1, 0.4], unit = "m", sigma = 1e-3, source = "drawing" }}
attitude = {{ value = [0.0, 0.0, {turn}], unit = "rad", sigma = 1e-3, source = "drawing" }}
noise = {{ value = 1e-3, unit = "m/s^2", sigma = 0.0, source = "data sheet" }}

[gyro]
on = "el"
attitude = {{ value = [0.0, 0.0, 0.0], unit = "rad", sigma = 1e-3, source = "drawing" }}
noise = {{ value = 1e-5, unit = "rad/s", sigma = 0.0, source = "data sheet" }}
"""
IMU = "\n".join(
    [
        "std_msgs/Header header",
        "geometry_msgs/Quaternion orientation",
        "float64[9] orientation_covariance",
        "geometry_msgs/Vector3 angular_velocity",
        "float64[9] angular_velocity_covariance",
        "geometry_msgs/Vector3 linear_acceleration",
        "float64[9] linear_acceleration_covariance",
        "=" * 80 + "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id",
        "=" * 80 + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec",
        "=" * 80 + "\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w",
        "=" * 80 + "\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z",
    ]
)


def swing() -> tuple[Array, Array, Array]:
    """Stamps, and the closed form of both readings: a turn about -y, by q = 1.3 + 0.1 sin(0.5 t).

    Along the link's axes the acceleration is q'' n x d - q'^2 (d - n (n d)), and upwards is z turned back by q.
    """
    stamp = np.arange(2000) * 10_000_000
    t = stamp * 1e-9
    q, rate, gain = 1.3 + 0.1 * np.sin(0.5 * t), 0.05 * np.cos(0.5 * t), -0.025 * np.sin(0.5 * t)
    n = np.array([0.0, -1.0, 0.0])
    upwards = np.stack([np.sin(q), np.zeros_like(q), np.cos(q)], axis=1)  # of the laboratory, in the link's axes
    across = np.cross(n, PLACE)
    inwards = PLACE - n * (n @ PLACE)
    accelerometer = gain[:, None] * across - rate[:, None] ** 2 * inwards + G * upwards
    rng = np.random.default_rng(4)
    gyro = rate[:, None] * n
    return (
        stamp,
        accelerometer + NOISE["accelerometer"] * rng.standard_normal(accelerometer.shape),
        gyro + NOISE["gyro"] * rng.standard_normal(gyro.shape),
    )


def with_instruments(folder: CampaignFolder, *, turn: float = 0.0, scale: float = 1.0) -> CampaignFolder:
    """Add both to the description, and to each recording but the first."""
    folder.append("parameters/rig.toml", DESCRIBED.format(turn=turn))
    folder.replace("campaign.toml", "[topics]\n", '[topics]\naccelerometer = "/imu"\ngyro = "/imu"\n')
    stamp, accelerometer, gyro = swing()
    rows = np.concatenate([scale * accelerometer, gyro], axis=1)
    for path in sorted((folder.path / "recordings").iterdir())[1:]:
        append_imu(path, stamp, rows)
    return folder


def append_imu(path: Path, stamp: Any, rows: Array) -> None:
    """Write a recording anew, with sensor_msgs/Imu beside what it has."""
    from mcap.reader import make_reader

    with path.open("rb") as stream:
        messages = [(schema, channel, message) for schema, channel, message in make_reader(stream).iter_messages()]
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2")
        channels: dict[str, int] = {}
        for schema, channel, _ in messages:
            if schema is not None and channel.topic not in channels:
                own = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.topic] = writer.register_channel(channel.topic, channel.message_encoding, own)
        own = writer.register_schema("sensor_msgs/msg/Imu", "ros2msg", IMU.encode())
        imu = writer.register_channel("/imu", "cdr", own)
        for _, channel, message in messages:
            writer.add_message(channels[channel.topic], message.log_time, message.data, message.publish_time)
        for at, row in zip(stamp.tolist(), rows.tolist(), strict=True):
            head = b"\x00\x01\x00\x00" + struct.pack("<iI", *divmod(at, 1_000_000_000)) + struct.pack("<I", 1) + b"\x00"
            head += bytes(-(len(head) - 4) % 8)
            numbers = [0.0] * 4 + [0.0] * 9 + row[3:] + [0.0] * 9 + row[:3] + [0.0] * 9
            writer.add_message(imu, at, head + struct.pack(f"<{len(numbers)}d", *numbers), at)
        writer.finish()


def processed(folder: CampaignFolder, out: Path) -> dict[str, Any]:
    process(load_campaign(folder.path, checksums=False), out, progress=SilentProgress(), pdf=False)
    found: dict[str, Any] = json.loads((out / "results.json").read_text())
    return found


def test_readings_agree_with_the_motion_where_they_are(tmp_path: Path) -> None:
    out = tmp_path / "out"
    found = processed(with_instruments(short_campaign(tmp_path / "EL089")), out)
    rows = found["instruments"]
    assert {row["recording"] for row in rows} == {"EL089P00_1", "EL089P00_2", "EL089P00_3"}
    assert [(row["instrument"], row["channel"]) for row in rows[:6]] == [
        (name, axis) for name in ("accelerometer", "gyro") for axis in "xyz"
    ]
    by = {(row["instrument"], row["channel"]): row for row in rows[:6]}
    for (name, axis), row in by.items():
        assert row["noise"] == pytest.approx(NOISE[name] * (2.0 * 1.5 * 2.0 / 100.0) ** 0.5)
        assert row["encoders_left"] < 3.0 * row["noise"] + 0.01 * row["measured"], (name, axis)
        assert row["predicted_left"] is not None
    assert by["gyro", "y"]["measured"] == pytest.approx(0.05 / np.sqrt(2.0), rel=0.2)
    assert by["accelerometer", "x"]["measured"] > 0.1
    assert not [one for one in found["warnings"] if "accelerometer" in one["what"] or "gyro" in one["what"]]
    page = (out / "index.html").read_text()
    assert "What accelerometer and gyro read" in page and "Accelerometer and gyro beside the motion" in page


@pytest.mark.parametrize(
    ("turn", "scale", "words"),
    [(0.0, 1.0 / G, "as if in g"), (np.pi, 1.0, "reads other directions than the encoders' motion has")],
)
def test_another_unit_and_other_axes_are_told(tmp_path: Path, turn: float, scale: float, words: str) -> None:
    found = processed(with_instruments(short_campaign(tmp_path / "EL089"), turn=turn, scale=scale), tmp_path / "out")
    (said,) = [one["what"] for one in found["warnings"] if "accelerometer" in one["what"]]
    assert words in said


def test_a_topic_without_a_place_is_refused(tmp_path: Path) -> None:
    folder = short_campaign(tmp_path / "EL089")
    folder.replace("campaign.toml", "[topics]\n", '[topics]\ngyro = "/imu"\n')
    error = str(folder.refusal())
    assert "nothing says where the gyro is" in error and "describe [gyro] in a parameter file" in error
