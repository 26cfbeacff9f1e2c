"""Sensors and recorder: levels, spectra, codes, clocks, and recordings that are beginnings of longer ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import welch

from engine import Hardware
from engine.sensors import PINK_CORNER, Recording, coloured, read_transducer, record
from engine.trajectories import Axis, commands

pytestmark = pytest.mark.slow

CAMPAIGN = Path(__file__).parents[2] / "campaigns" / "EL089"
HARDWARE = Hardware.from_campaign(CAMPAIGN, seed=3)
PATH = commands(Axis(0.0).rest(1.0).accelerate(0.5, 0.1), Axis(75.0), 6.0)
EPOCH = 803_206_800_000_000_000


@pytest.fixture(scope="module")
def recording() -> Recording:
    return record(HARDWARE, PATH, seed=5, epoch_ns=EPOCH)


def test_noise_is_white_with_a_pink_foot() -> None:
    rate, n = 10.0, 400_000
    noise = coloured(np.random.default_rng(1), n, rate)
    f, S = welch(noise, rate, nperseg=2**14, axis=0)
    density = S.mean(axis=1) * rate / 2  # 1 is white noise of unit variance
    for low, high in ((0.5, 4.0), (0.004, 0.012)):
        band = (f > low) & (f < high)
        expected = np.mean(1 + PINK_CORNER / f[band])
        assert density[band].mean() == pytest.approx(expected, rel=0.08)


def test_transducer_reads_what_the_calibration_says() -> None:
    t = np.arange(0, 400, 0.01)
    wrench = np.tile([0.4, -0.3, -274.0, 6.0, -5.0, 0.2], (len(t), 1))
    raw = read_transducer(HARDWARE, t, wrench, np.zeros(6), np.random.default_rng(2))
    X = HARDWARE["transducer.cross_coupling"]
    recovered = np.linalg.solve(np.eye(6) + X, (raw - HARDWARE["transducer.bias"]).T).T
    noise = HARDWARE["transducer.noise"]
    assert np.all(np.abs(recovered.mean(axis=0) - wrench[0]) < 3 * (noise + 0.05 * noise.max()))
    np.testing.assert_allclose(raw.std(axis=0), noise, rtol=0.35)
    codes = raw / HARDWARE["transducer.resolution"]
    np.testing.assert_array_equal(codes, np.round(codes))


def test_encoder_reads_codes(recording: Recording) -> None:
    codes = recording.encoder.values / HARDWARE.scalar("joint.az.encoder.step")
    np.testing.assert_allclose(codes, np.round(codes), atol=1e-6)
    assert len(np.unique(np.round(codes[:, 0]))) > 20


def test_clocks_and_latency(recording: Recording) -> None:
    for stream, clock in ((recording.wrench, recording.wrench_clock), (recording.encoder, recording.encoder_clock)):
        assert np.all(np.diff(stream.stamp) == 10_000_000)
        assert np.all(np.diff(stream.log) >= 0)
        reading = (stream.stamp - EPOCH) * 1e-9
        instant = (reading - clock.offset) / (1 + clock.skew)
        latency = (stream.log - EPOCH) * 1e-9 - instant
        assert latency.min() > 0.19e-3
        assert latency.max() < 2.01e-3


def test_a_shorter_recording_is_the_beginning_of_a_longer_one(recording: Recording) -> None:
    short = record(HARDWARE, PATH.until(3.0), seed=5, epoch_ns=EPOCH)
    for whole, part in (
        (recording.wrench, short.wrench),
        (recording.encoder, short.encoder),
        (recording.command, short.command),
    ):
        n = len(part.stamp)
        assert 0 < n < len(whole.stamp)
        np.testing.assert_array_equal(part.values, whole.values[:n])
        np.testing.assert_array_equal(part.stamp, whole.stamp[:n])
        np.testing.assert_array_equal(part.log, whole.log[:n])


def test_runs_differ_a_little(recording: Recording) -> None:
    other = record(HARDWARE, PATH.until(0.2), seed=6, epoch_ns=EPOCH)
    ratio = other.hardware.drive("el", "d0") / recording.hardware.drive("el", "d0")
    assert ratio != 1.0
    assert ratio == pytest.approx(1.0, abs=0.042)
    assert other.hardware.drive("el", "phi_dyn") == recording.hardware.drive("el", "phi_dyn")
