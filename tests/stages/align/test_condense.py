"""A recording with all that recordings have comes out on one axis, with its losses counted."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kbs_process.errors import RecordingError
from kbs_process.signals.records import WRENCH_CHANNELS, Block, Run
from kbs_process.stages.align.condense import CondenseSettings, condense
from stages.recordings import EPOCH, chunks, rows, stream

CHANNELS = {"wrench": WRENCH_CHANNELS, "angle": ("az", "el"), "command": ("az", "el"), "temperature": ("T",)}
SETTINGS = CondenseSettings()


def wrench(t: np.ndarray) -> np.ndarray:
    return np.column_stack([np.sin(2.0 * np.pi * (0.05 + 0.4 * k) * t + k) for k in range(6)])


def angles(t: np.ndarray) -> np.ndarray:
    return np.column_stack((np.sin(2.0 * np.pi * 0.5 * t), 0.005 * t))


def celsius(t: np.ndarray) -> np.ndarray:
    return (20.0 + 0.01 * t)[:, None]


def recording() -> dict[str, Block]:
    drive = {"offset": 0.123, "skew": 35e-6}
    return {
        "wrench": stream(wrench, 1000.0, 60.0, seed=1),
        "angle": stream(angles, 100.0, 62.0, start=-1.0, seed=2, **drive),
        "command": stream(angles, 10.0, 62.0, start=-1.0, seed=3, **drive),
        "temperature": stream(celsius, 1.0, 62.0, start=-1.0, seed=4),
    }


def run_of(streams: dict[str, Block], name: str = "test") -> Run:
    return condense(name, streams.items(), {key: CHANNELS[key] for key in streams}, SETTINGS)


def loss(run: Run, kind: str) -> int:
    return sum(entry.count for entry in run.losses if entry.kind == kind)


def error(run: Run) -> np.ndarray:
    assert run.wrench is not None
    return np.abs(run.wrench.values - wrench(run.wrench.t))[run.wrench.valid]


def test_every_stream_lies_on_the_wrench_sensor_clock() -> None:
    run = run_of(recording())
    assert run.wrench is not None and run.angle is not None
    assert run.command is not None and run.encoder is not None and run.temperature is not None
    assert len(run.wrench) == len(run.angle) == 1200
    assert run.epoch_ns == EPOCH
    assert error(run).max() < 1e-4
    assert run.wrench.valid.sum() > 1200 - 2 * 30
    clock = run.clocks["angle"]
    slip = 3.0 * clock.sigma_offset_s * np.pi  # the angle's greatest rate, rad/s
    assert np.abs(run.angle.values - angles(run.angle.t))[run.angle.valid].max() < slip
    assert np.abs(run.encoder.t - (np.arange(6200) / 100.0 - 1.0)).max() < 3.0 * clock.sigma_offset_s
    # Encoder and command come from the same electronics and keep their relation to the nanosecond.
    assert np.abs(run.encoder.t[::10] - run.command.t).max() < 2e-9
    assert np.abs(run.temperature.values[:, 0] - 20.0 - 0.01 * run.temperature.t).max() < 1e-4
    assert run.losses == ()
    assert run.rates["wrench"] == pytest.approx(1000.0, rel=1e-9)


def test_no_result_depends_on_the_chunks_of_the_file() -> None:
    streams = damaged()
    runs = [
        condense("test", chunks(streams, seed, mean), {key: CHANNELS[key] for key in streams}, SETTINGS)
        for seed, mean in ((1, 7.0), (2, 900.0), (3, 1e5))
    ]
    for run in runs[1:]:
        assert run.losses == runs[0].losses
        assert run.clocks == runs[0].clocks
        for name in ("wrench", "angle", "command", "temperature", "encoder", "spectrum", "envelope"):
            a, b = getattr(run, name), getattr(runs[0], name)
            for field in dataclasses.fields(a):
                np.testing.assert_array_equal(getattr(a, field.name), getattr(b, field.name))


def damaged() -> dict[str, Block]:
    """30 lost samples at 20 s, 5 single ones, 10 repeats, 200 samples 40 too late, 3 not finite."""
    streams = recording()
    whole = streams["wrench"]
    order = np.arange(len(whole))
    order[30_000:30_240] = np.concatenate((order[30_200:30_240], order[30_000:30_200]))
    order = np.delete(order, [*range(20_000, 20_030), 5000, 6000, 7000, 8000, 9000])
    order = np.insert(order, 40_000, order[39_990:40_000])
    wounded = rows(whole, order)
    wounded.values[[50_000, 51_000, 52_000], [0, 3, 5]] = [np.nan, np.inf, -np.inf]
    return {**streams, "wrench": wounded}


def test_losses_are_counted_and_located_and_what_they_touch_is_flagged() -> None:
    run = run_of(damaged())
    assert run.wrench is not None
    assert loss(run, "gap") == 35
    assert loss(run, "repeat") == 10
    assert loss(run, "put in order") == 209  # 200 displaced, and 9 of the 10 repeats come late too
    assert loss(run, "out of order") == 0
    assert loss(run, "non-finite") == 3
    (told,) = [entry.detail for entry in run.losses if entry.kind == "non-finite"]
    assert told == "Fx in 1, Tx in 1, Tz in 1: interpolated"
    long_gap = next(entry for entry in run.losses if entry.kind == "gap" and entry.count == 30)
    assert long_gap.start_s == pytest.approx(19.999) and long_gap.end_s == pytest.approx(20.03)
    t, valid = run.wrench.t, run.wrench.valid
    assert not valid[(t > 19.9) & (t < 20.1)].any()
    assert valid[(t > 21.5) & (t < 29.0)].all()
    assert error(run).max() < 2e-3  # a flagged share of 0.1 % at most


def test_what_is_put_in_order_is_told_and_is_no_loss() -> None:
    streams = recording()
    order = np.arange(len(streams["wrench"]))
    order[[3000, 3001, 40_000, 40_001]] = [3001, 3000, 40_001, 40_000]
    run = run_of({**streams, "wrench": rows(streams["wrench"], order)})
    assert [(one.kind, one.count, one.real) for one in run.losses] == [("put in order", 2, False)]
    np.testing.assert_array_equal(run.wrench.values, run_of(streams).wrench.values)


def test_what_comes_too_late_to_be_put_in_order_is_a_loss() -> None:
    streams = recording()
    order = np.arange(len(streams["wrench"]))
    run = run_of({**streams, "wrench": rows(streams["wrench"], np.append(np.delete(order, 1000), 1000))})
    (late,) = [one for one in run.losses if one.kind == "out of order"]
    assert (late.count, late.real) == (1, True)
    assert loss(run, "put in order") == 0
    assert loss(run, "gap") == 1


@pytest.mark.parametrize(
    ("stream_key", "column", "first", "words"),
    [
        ("wrench", 2, 0, ("run.mcap: wrench: none of 60000 samples", "NaN or infinite: Fz in 60000", "channels")),
        ("wrench", 2, 100, ("100 of 60000 samples", "Fz in 59900", "20 Hz need")),
        ("angle", 0, 0, ("run.mcap: encoder: none of 6200", "az in 6200", "`joints` of [topics.encoder]")),
        ("command", 1, 0, ("run.mcap: command: none of 620", "el in 620", "record the commands")),
    ],
)
def test_a_channel_without_numbers_is_named(stream_key: str, column: int, first: int, words: tuple[str, ...]) -> None:
    streams = recording()
    streams[stream_key].values[first:, column] = np.nan
    with pytest.raises(RecordingError) as caught:
        condense("run", streams.items(), {key: CHANNELS[key] for key in streams}, SETTINGS, file="/data/run.mcap")
    for word in words:
        assert word in str(caught.value)
    assert "record longer" not in str(caught.value)


def test_an_optional_channel_without_numbers_is_lost_and_no_more() -> None:
    streams = recording()
    streams["temperature"].values[:] = np.nan
    run = run_of(streams)
    assert run.temperature is None
    assert loss(run, "non-finite") == 62


def test_stamps_that_stand_still_are_replaced_by_the_recorder_clock() -> None:
    streams = recording()
    dead = streams["angle"]
    streams["angle"] = Block(np.zeros_like(dead.stamp), dead.log, dead.values)
    run = run_of(streams)
    assert run.angle is not None and run.clocks["angle"].source == "recorder"
    assert loss(run, "clock") == 6200
    late = 4e-3 * np.pi  # latencies now are errors of time
    assert np.abs(run.angle.values - angles(run.angle.t))[run.angle.valid].max() < late


def test_a_recorder_clock_that_says_nothing_leaves_the_stamps_as_they_are() -> None:
    streams = {
        key: Block(block.stamp, np.full_like(block.log, EPOCH), block.values)
        for key, block in (("wrench", stream(wrench, 240.0, 30.0)), ("angle", stream(angles, 240.0, 30.0)))
    }
    run = run_of(streams)
    assert run.angle is not None and run.clocks["angle"].source == "not comparable"
    assert np.abs(run.angle.values - angles(run.angle.t))[run.angle.valid].max() < 1e-4


def test_a_wild_stamp_is_dropped_and_counted() -> None:
    streams = recording()
    streams["wrench"].stamp[31_234] += 3_600_000_000_000
    run = run_of(streams)
    assert loss(run, "odd stamp") == 1 and loss(run, "gap") == 1
    assert error(run).max() < 2e-3


def test_jittered_sampling_is_interpolated() -> None:
    rng = np.random.default_rng(8)
    times = (np.arange(60_000) + rng.uniform(-0.2, 0.2, 60_000)) / 1000.0
    run = run_of({"wrench": stream(wrench, 1000.0, 60.0, times=times)})
    assert run.wrench is not None
    t = run.wrench.t + times[0]
    assert np.abs(run.wrench.values - wrench(t))[run.wrench.valid].max() < 1e-4


def test_what_a_fast_sensor_misses_for_less_than_the_band_shows_is_bridged() -> None:
    """Stamps that jitter by a fifth of 0.1 ms are equal now and then, and one of two is dropped."""
    rng = np.random.default_rng(9)
    times = np.sort(np.arange(600_000) + 0.2 * rng.standard_normal(600_000)) / 10_000.0
    times[20_000::1000] = times[19_999:-1:1000]
    kept = np.delete(times, slice(300_000, 300_200))
    run = run_of({"wrench": stream(wrench, 10_000.0, 60.0, times=kept)})
    assert run.wrench is not None
    assert loss(run, "repeat") == pytest.approx(580, abs=2)
    assert loss(run, "short gap") == pytest.approx(loss(run, "repeat"), rel=0.2)  # jitter makes some
    assert loss(run, "gap") == pytest.approx(200, abs=2)
    t, valid = run.wrench.t, run.wrench.valid
    missing = np.abs(t + kept[0] - 30.01) < 0.03
    assert missing.any() and not valid[missing].any()
    assert np.mean(valid) > 0.95
    assert np.abs(run.wrench.values - wrench(t + kept[0]))[valid].max() < 1e-3


def test_duplicate_stamps_and_repeated_values_survive() -> None:
    block = stream(lambda t: np.column_stack((np.sin(t), np.round(np.cos(t), 1))), 100.0, 50.0)
    block.stamp[[1000, 2000, 3000]] = block.stamp[[999, 1999, 2999]]
    run = condense("treadmill", [("wrench", block)], {"wrench": ("Tx", "Ty")}, SETTINGS)
    assert run.wrench is not None
    assert loss(run, "repeat") == 3 and loss(run, "gap") == 3
    assert np.abs(run.wrench.column("Tx") - np.sin(run.wrench.t))[run.wrench.valid].max() < 1e-4


def test_an_absolute_encoder_is_followed_through_full_turns() -> None:
    def turning(t: np.ndarray) -> np.ndarray:
        return np.column_stack((np.mod(2.0 * t, 2.0 * np.pi), np.mod(-3.0 * t, 2.0 * np.pi)))

    run = condense("wheel", [("angle", stream(turning, 240.0, 30.0))], {"angle": ("wheel", "other")}, SETTINGS)
    assert run.angle is not None and run.wrench is None and run.spectrum is None and run.encoder is None
    np.testing.assert_allclose(run.angle.values[50:-50, 0], 2.0 * run.angle.t[50:-50], atol=1e-4)
    np.testing.assert_allclose(
        run.angle.values[50:-50, 1], 2 * np.pi - 3.0 * run.angle.t[50:-50], atol=2 * np.pi + 1e-4
    )


def test_a_joint_that_slides_is_no_angle() -> None:
    """After a gap it may be farther on than half a turn is in rad."""

    def sliding(t: np.ndarray) -> np.ndarray:
        return np.column_stack((np.where(t < 15.0, 0.0, 4.0), np.where(t < 15.0, 0.0, 4.0)))

    found = condense(
        "slide",
        [("angle", stream(sliding, 240.0, 30.0))],
        {"angle": ("slide", "wheel")},
        SETTINGS,
        units={"angle": ("m", "rad")},
    )
    assert found.angle is not None
    np.testing.assert_allclose(found.angle.values[-50, :], [4.0, 4.0 - 2.0 * np.pi], atol=1e-6)


def test_a_stream_that_begins_late_is_flagged_until_it_does() -> None:
    streams = {"wrench": stream(wrench, 1000.0, 40.0), "angle": stream(angles, 100.0, 20.0, start=10.0)}
    run = run_of(streams)
    assert run.angle is not None
    t, valid = run.angle.t, run.angle.valid
    assert not valid[(t < 10.0) | (t > 30.0)].any() and valid[(t > 12.0) & (t < 28.0)].all()
    assert np.isfinite(run.angle.values).all()


def test_recordings_that_cannot_be_used_say_what_to_do() -> None:
    empty = {"wrench": rows(recording()["wrench"], slice(0, 0))}
    with pytest.raises(RecordingError, match=r"0 samples[\s\S]*->"):
        run_of(empty)
    with pytest.raises(RecordingError, match=r"short: wrench: 400 samples in 0.399 s are too few[\s\S]*->"):
        run_of({"wrench": rows(recording()["wrench"], slice(0, 400))}, "short")
    with pytest.raises(RecordingError, match=r"slow: wrench: samples come every 10 s[\s\S]*unit of its times"):
        run_of({"wrench": stream(lambda t: wrench(t / 1e3), 0.1, 5000.0)}, "slow")
    with pytest.raises(RecordingError, match="neither wrench nor joint angles"):
        run_of({"command": recording()["command"]})


def test_progress_counts_every_sample() -> None:
    taken: dict[str, int] = {}

    def progress(key: str, samples: int) -> None:
        taken[key] = taken.get(key, 0) + samples

    streams = recording()
    condense("test", chunks(streams, 1, 500.0), CHANNELS, SETTINGS, progress)
    assert taken == {key: len(block) for key, block in streams.items()}
