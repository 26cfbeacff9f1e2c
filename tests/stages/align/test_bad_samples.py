"""Single bad samples, odd stamps, lost counts and clocks set back: named, and left out or refused; all else stays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from kbs_process.errors import RecordingError
from kbs_process.signals.records import Block, Loss, Run
from kbs_process.stages.align.condense import CondenseSettings, condense
from kbs_process.stages.align.stream import Timeline
from stages.recordings import EPOCH, rows, stream

CHANNELS = {"wrench": ("Fz", "Ty"), "angle": ("arm",)}
LATENCY = 2e-4  # s
NOISE = 2e-3
HOUR = 3_600_000_000_000


def truth(t: np.ndarray) -> np.ndarray:
    return np.column_stack((-50.0 + 2.0 * np.sin(0.4 * t), 6.0 * np.cos(0.4 * t)))


def turn(t: np.ndarray) -> np.ndarray:
    return 0.6 - 0.6 * np.cos(0.4 * t)[:, None]


def recording(rate: float = 100.0, duration: float = 60.0) -> dict[str, Block]:
    wrench = stream(truth, rate, duration, seed=1, latency=LATENCY)
    wrench.values[:] += np.random.default_rng(3).normal(0.0, NOISE, wrench.values.shape)
    return {"wrench": wrench, "angle": stream(turn, rate, duration, seed=2, latency=LATENCY)}


def run_of(streams: dict[str, Block]) -> Run:
    return condense("test", streams.items(), {key: CHANNELS[key] for key in streams}, CondenseSettings())


def told(run: Run, kind: str) -> list[Loss]:
    return [loss for loss in run.losses if loss.kind == kind]


def error(run: Run) -> tuple[float, float]:
    """Largest error of the wrench and of the angle, where they are valid: most of the time."""
    assert run.wrench is not None and run.angle is not None
    assert run.wrench.valid.mean() > 0.9 and run.angle.valid.mean() > 0.9
    late = (run.epoch_ns - EPOCH) * 1e-9
    wrench = np.abs(run.wrench.values - truth(run.wrench.t + late))[run.wrench.valid].max()
    angle = np.abs(run.angle.values - turn(run.angle.t + late))[run.angle.valid].max()
    return float(wrench), float(angle)


def test_a_sound_recording_gives_no_notice() -> None:
    run = run_of(recording())
    assert run.losses == ()
    assert error(run)[0] < 4.0 * NOISE


@pytest.mark.parametrize(
    ("channel", "rows_", "value", "count"),
    [
        (0, slice(3000, 3001), 0.0, 1),
        (1, slice(3000, 3001), 1.0, 1),  # N m more than there is
        (1, slice(2000, 2003), 32.767, 1),
        (0, [2000, 2003], 32.767, 2),
        (0, [1990, 2000, 2004, 2011], 0.0, 4),
        (1, [1000, 3001, 4990], 32.767, 3),
    ],
)
def test_spikes_are_named_with_channel_and_time_and_interpolated(
    channel: int, rows_: slice | list[int], value: float, count: int
) -> None:
    streams = recording()
    values = streams["wrench"].values
    values[rows_, channel] = values[rows_, channel] + 1.0 if value == 1.0 else value
    run = run_of(streams)
    (spike,) = told(run, "spike")
    first = rows_.start if isinstance(rows_, slice) else rows_[0]
    assert spike.count == count and spike.where.endswith(CHANNELS["wrench"][channel])
    assert spike.start_s == pytest.approx(0.01 * first, abs=1e-6)
    assert error(run)[0] < 6.0 * NOISE


def test_a_spike_beside_a_channel_whose_readings_are_coarse_is_no_blow() -> None:
    streams = recording()
    values = streams["wrench"].values
    values[:, 1] = 0.4 * np.round(values[:, 1] / 0.4)
    values[3000, 0] += 1.0
    (spike,) = told(run_of(streams), "spike")
    assert spike.count == 1 and spike.where.endswith("Fz")


def test_a_reading_lost_in_all_channels_is_left_out() -> None:
    streams = recording()
    streams["wrench"].values[3000] = 0.0
    run = run_of(streams)
    assert [loss.where[-2:] for loss in told(run, "spike")] == ["Fz", "Ty"]
    assert error(run)[0] < 4.0 * NOISE


def test_zeros_of_an_encoder_that_turns_through_half_a_turn_are_left_out() -> None:
    streams = recording()
    angle = streams["angle"].values
    angle[:] = np.mod(angle + np.pi - 0.3, 2.0 * np.pi)
    angle[[1000, 1180, 4000]] = 0.0
    run = run_of(streams)
    assert run.angle is not None
    found = run.angle.values[:, 0] - turn(run.angle.t)[:, 0]
    assert sum(loss.count for loss in told(run, "spike")) == 3
    assert np.ptp(found[run.angle.valid]) < 1e-3


@pytest.mark.parametrize("by", [1.79, -0.01])
def test_an_encoder_that_loses_its_count_is_refused(by: float) -> None:
    streams = recording()
    streams["angle"].values[4000:] += by
    with pytest.raises(RecordingError, match=r"arm steps by .* 40(\.\d*)? s after the first, and stays") as found:
        run_of(streams)
    assert "start_s" in str(found.value)


def test_a_zero_that_is_set_on_the_way_is_refused() -> None:
    streams = recording()
    streams["wrench"].values[3000:, 0] += 50.0
    with pytest.raises(RecordingError, match="Fz steps by 5"):
        run_of(streams)


def test_a_blow_that_rings_stays_as_it_is() -> None:
    streams = recording(1000.0)
    wrench = streams["wrench"].values
    t = np.arange(500) * 1e-3
    wrench[20_000:20_500] += 20.0 * np.exp(-t / 0.05)[:, None] * np.sin(2.0 * np.pi * 240.0 * t)[:, None]
    run, as_it_was = run_of(streams), run_of(recording(1000.0))
    assert run.losses == ()
    assert run.envelope is not None and as_it_was.envelope is not None
    assert run.envelope.high[:, 1].max() > 15.0


@pytest.mark.parametrize("off", [5.0003, 5.0, -3.0, 0.05, 7200.0])
@pytest.mark.parametrize("key", ["wrench", "angle"])
def test_odd_stamps_are_left_out_and_named(off: float, key: str) -> None:
    streams = recording()
    streams[key].stamp[[1000, 3100, 4800]] += round(off * 1e9)
    run = run_of(streams)
    (odd,) = told(run, "odd stamp")
    assert (odd.count, odd.where) == (3, f"test: {key}")
    assert odd.start_s == pytest.approx(9.99, abs=2e-3) and odd.end_s == pytest.approx(47.99, abs=2e-3)
    assert told(run, "put in order") == [] and error(run)[0] < 4.0 * NOISE


@pytest.mark.parametrize("which", [slice(0, 1), slice(0, 50), slice(-1, None)])
@pytest.mark.parametrize("by", [-EPOCH, -24 * HOUR, 24 * HOUR])
def test_a_few_samples_far_from_all_others_are_left_out(which: slice, by: int) -> None:
    streams = recording()
    for one in streams.values():
        one.stamp[which] += by
        one.log[which] += by
    run = run_of(streams)
    assert sum(loss.count for loss in run.losses if loss.kind in ("far stamp", "odd stamp", "out of order")) > 0
    assert run.wrench is not None and len(run.wrench) <= 1200
    assert error(run)[0] < 4.0 * NOISE


@pytest.mark.parametrize("by", [0.0437, 0.4037, 20.0])
def test_a_clock_that_is_set_back_is_refused(by: float) -> None:
    streams = recording()
    streams["angle"].stamp[3000:] -= round(by * 1e9)
    with pytest.raises(RecordingError, match=f"time goes back by {by:.6g} s at sample 3001, 29.99 s after the first"):
        run_of(streams)


def test_a_logger_that_started_again_is_refused() -> None:
    streams = recording()
    streams = {key: rows(one, np.tile(np.arange(len(one)), 2)) for key, one in streams.items()}
    for one in streams.values():
        one.log[:] = one.stamp
        one.values[6000:] *= 0.9
    with pytest.raises(RecordingError, match=r"time goes back by 60 s at sample 6001, 59.99 s after the first"):
        run_of(streams)


def test_a_gap_longer_than_the_recording_is_refused_at_once() -> None:
    streams = recording()
    for one in streams.values():
        one.stamp[3000:] += 1000 * HOUR
        one.log[3000:] += 1000 * HOUR
    with pytest.raises(RecordingError, match=r"a gap of 3.6e\+06 s, longer than all that is there") as found:
        run_of(streams)
    assert "start_s" in str(found.value)


def test_streams_without_common_time_are_refused() -> None:
    streams = recording()
    angle = streams["angle"]
    streams["angle"] = replace(angle, stamp=angle.stamp + HOUR, log=angle.log + HOUR)
    with pytest.raises(RecordingError, match="3600 s after that of wrench"):
        run_of(streams)


@pytest.mark.parametrize("every", [1, 2, 3, 10])
def test_two_sources_in_one_stream_are_refused(every: int) -> None:
    streams = recording()
    wrench = streams["wrench"]
    other = rows(wrench, slice(None, None, every))
    late = Block(other.stamp + 5_000_000, other.log + 5_000_000, np.zeros_like(other.values))
    both = [np.concatenate(pair) for pair in ((wrench.stamp, late.stamp), (wrench.log, late.log))]
    order = np.argsort(both[1])
    values = np.concatenate((wrench.values, late.values))
    streams["wrench"] = Block(both[0][order], both[1][order], values[order])
    with pytest.raises(RecordingError, match="two sources are in one stream"):
        run_of(streams)


@pytest.mark.parametrize("frequency", [50.005, 50.013, 49.98, 50.3])
def test_a_hum_that_beats_with_the_sampling_is_no_second_source(frequency: float) -> None:
    streams = recording(100.0, 90.0)
    hum = 0.2 * np.sin(2.0 * np.pi * frequency * np.arange(9000) * 0.01 + 0.3)
    streams["wrench"].values[:] += hum[:, None]
    run = run_of(streams)
    assert run.losses == () and error(run)[0] < 4.0 * NOISE


def test_a_source_that_reads_nothing_between_loads_that_swing_is_a_second_one() -> None:
    streams = recording(100.0, 90.0)
    streams["wrench"].values[::2, 1] = np.random.default_rng(8).normal(0.0, NOISE, 4500)
    with pytest.raises(RecordingError, match="Ty changes to and fro"):
        run_of(streams)


@pytest.mark.parametrize("by", [-0.4037, -0.0437, -0.01, 0.004, 0.01, 0.02])
def test_a_clock_that_is_set_by_little_is_refused(by: float) -> None:
    streams = recording()
    streams["angle"].stamp[3000:] -= round(by * 1e9)
    with pytest.raises(RecordingError, match=r"encoder: log times less stamps step by .*a clock was set"):
        run_of(streams)


def test_a_recorder_s_clock_that_is_set_is_refused() -> None:
    streams = recording()
    streams["angle"].stamp[3000:] += 500_000_000
    for one in streams.values():
        one.log[3000:] += 500_000_000
    with pytest.raises(RecordingError, match=r"wrench: log times less stamps step by \+0.5 s.*stamps of encoder jump"):
        run_of(streams)


@pytest.mark.parametrize("growth", [3e-3, 25e-3, -1e-3])
def test_a_latency_that_grows_is_no_skew(growth: float) -> None:
    streams = recording()
    wrench = streams["wrench"]
    wrench.log[:] += (growth * (wrench.stamp - EPOCH)).astype(np.int64)
    run = run_of(streams)
    (clock,) = told(run, "clock")
    assert clock.where == "test: wrench" and f"by {1e3 * abs(growth):.3g} ms each second" in clock.detail
    assert run.clocks["angle"].skew == 0.0 and abs(run.clocks["angle"].offset_s) < 1e-6
    assert error(run)[1] < 1e-3


def test_a_latency_that_comes_and_goes_or_steps_moves_no_clock() -> None:
    t = np.arange(6000) * 0.01
    for late in (np.interp(t, [0, 20, 30, 40, 60], [0, 0, 2, 0, 0]), 0.02 * (t > 30.0), 3e-6 * t**2):
        streams = recording()
        streams["wrench"].log[:] += np.rint(1e9 * late).astype(np.int64)
        run = run_of(streams)
        assert error(run)[1] < 1e-3 and error(run)[0] < 4.0 * NOISE
        assert abs(run.clocks["angle"].offset_s) < 1e-3


@pytest.mark.parametrize("rate", [999.7, 1000.6, 800.0, 333.3])
@pytest.mark.parametrize("logged", [True, False])
def test_stamps_rounded_to_a_period_hide_a_regular_rate_and_lose_nothing(rate: float, logged: bool) -> None:
    streams = recording(rate)
    for one in streams.values():
        one.stamp[:] = EPOCH + 1_000_000 * np.rint((one.stamp - EPOCH) / 1e6).astype(np.int64)
        if not logged:
            one.log[:] = one.stamp
    if rate > 1000.0:  # what shares its stamp with another is a repeat
        streams = {key: rows(one, np.unique(one.stamp, return_index=True)[1]) for key, one in streams.items()}
    run = run_of(streams)
    if rate < 1000.0:
        assert {loss.kind for loss in run.losses} == {"rounded stamps"} and not any(loss.real for loss in run.losses)
        assert run.rates["wrench"] == pytest.approx(rate, rel=2e-4)
    assert error(run)[0] < 4.0 * NOISE and error(run)[1] < 1e-3


def test_log_times_that_are_the_rounded_stamps_tell_of_no_clock() -> None:
    streams = recording(99.97, 120.0)
    for one in streams.values():
        one.stamp[:] = EPOCH + 10_000_000 * np.rint((one.stamp - EPOCH) / 1e7).astype(np.int64)
        one.log[:] = one.stamp
    run = run_of(streams)
    assert told(run, "rounded stamps") and not told(run, "clock")


def test_stamps_that_are_regular_as_they_are_were_not_rounded() -> None:
    for rate in (20.0, 50.0, 1000.0):
        streams = recording(rate)
        for one in streams.values():
            one.log[:] = one.stamp
        assert run_of(streams).losses == ()


def test_samples_lost_of_rounded_stamps_are_gaps() -> None:
    streams = recording(1000.0)
    keep = np.delete(np.arange(60_000), [7000, 7500, 9000, *range(30_000, 30_040)])
    streams["wrench"] = rows(streams["wrench"], keep)
    run = run_of(streams)
    assert sum(loss.count for loss in run.losses if loss.kind in ("gap", "short gap")) == 43


@pytest.mark.parametrize(
    "lost", [(1500, 5010), (1500, 5010, 9000), (900, 4000, 7100), (5000,), (3000, 3100), range(60, 12_000, 60)]
)
def test_rows_that_are_missing_among_stamps_of_whole_periods_are_gaps(lost: Sequence[int]) -> None:
    streams = {key: rows(one, np.delete(np.arange(12_000), lost)) for key, one in recording(100.0, 120.0).items()}
    for one in streams.values():
        one.log[:] = one.stamp
    run = run_of(streams)
    assert run.rates == {"wrench": pytest.approx(100.0, rel=1e-9), "angle": pytest.approx(100.0, rel=1e-9)}
    assert {loss.kind for loss in run.losses} <= {"gap", "short gap"}
    assert sum(loss.count for loss in run.losses) == 2 * len(lost)
    assert error(run)[0] < 4.0 * NOISE


def test_when_samples_were_made_up_is_known() -> None:
    streams = recording()
    lost = [2000, *range(3000, 3050)]
    streams["wrench"] = rows(streams["wrench"], np.delete(np.arange(6000), lost))
    streams["angle"].values[4000:4010] = np.nan
    run = run_of(streams)
    ends = [(-np.inf, 0.0), (59.99, np.inf)]
    expected = [ends[0], (19.99, 20.01), (29.99, 30.5), ends[1], ends[0], (39.99, 40.1), ends[1]]
    assert run.gaps == pytest.approx(np.array(expected), abs=2e-3)
    streams = recording(5.0)
    streams["wrench"].values[150:153, 0] += 10.0
    run = run_of(streams)
    assert [loss.count for loss in told(run, "spike")] == [1] and bridged(run) == [("spike", 30.0, 0.6, True)]


def bridged(run: Run) -> list[tuple[str, float, float, bool]]:
    return [(one.kind, round(one.start, 3), round(one.length, 3), one.likely) for one in run.stretches]


@pytest.mark.parametrize(
    ("knock", "likely"),
    [
        ([[0.0, 5.0]], [True]),
        ([[0.0, 2.0], [0.0, 3.0], [0.0, 2.1]], [True]),  # three samples of one channel
        ([[4.0, 5.0]], [True, True]),  # one of two
    ],
)
def test_what_is_off_its_neighbours_may_be_a_knock(knock: list[list[float]], likely: list[bool]) -> None:
    streams = recording()
    streams["wrench"].values[3000 : 3000 + len(knock)] += knock
    run = run_of(streams)
    expected = [("spike", 30.0, round(0.01 * len(knock), 3), one) for one in likely]
    assert bridged(run) == expected
    told_of = told(run, "spike")[0]
    assert told_of.count == 1 and ("3 samples" in told_of.detail) == (len(knock) == 3)


def test_what_a_driver_fills_in_is_no_knock() -> None:
    for which, value in ((slice(3000, 3001), 0.0), (slice(3000, 3003), 32.767)):
        streams = recording()
        streams["wrench"].values[which] = value
        assert {one[3] for one in bridged(run_of(streams))} == {False}
    streams["wrench"].values[3000:3008] = 0.0  # longer than a knock that is taken for bad samples
    assert {one[0] for one in bridged(run_of(streams))} == {"dropout"}
    streams = recording(5.0)
    streams["wrench"].values[150, 0] = 0.0  # of one channel
    assert bridged(run_of(streams)) == [("spike", 30.0, 0.2, False)]


@pytest.mark.parametrize("lost", [1, 2, 5])
@pytest.mark.parametrize("lacking", ["rows", "numbers"])
@pytest.mark.parametrize("shaken", [False, True])
def test_rows_that_are_missing_may_hide_what_happened_where_those_beside_them_are_shaken(
    lost: int, lacking: str, shaken: bool
) -> None:
    streams, gone = recording(), range(3000, 3000 + lost)
    streams["angle"].values[2000:2010] = np.nan  # which hides no load
    streams["wrench"].values[2999 : 3001 + lost, 1] += 20.0 * NOISE * shaken  # what rises and falls, its top is lost
    if lacking == "rows":
        streams["wrench"] = rows(streams["wrench"], np.delete(np.arange(6000), gone))
    else:
        streams["wrench"].values[gone] = np.nan
    assert bridged(run_of(streams)) == [("gap", 29.99, round(0.01 * lost, 3), shaken)]


@pytest.mark.parametrize(("key", "span"), [("angle", 0.25), ("wrench", 1.5)])
def test_numbers_that_are_too_short_for_what_they_hold_are_refused(key: str, span: float) -> None:
    streams = recording()
    streams[key].values[:] = np.mod(streams[key].values, span)
    with pytest.raises(RecordingError, match="which is all that it spans"):
        run_of(streams)


def test_a_load_that_is_put_on_and_off_is_none_of_them() -> None:
    streams = recording()
    streams["wrench"].values[:, 0] += 50.0 * (np.arange(6000) // 700 % 2)
    assert not told(run_of(streams), "spike")


@pytest.mark.parametrize("times", [10, 20, 100])
def test_readings_that_a_logger_holds_are_not_lost(times: int) -> None:
    streams = recording()
    streams["wrench"].values[:] = streams["wrench"].values[np.arange(6000) // times * times]
    assert not told(run_of(streams), "dropout") and not told(run_of(streams), "spike")


def test_bursts_that_were_stamped_on_arrival_are_refused_by_name() -> None:
    streams = recording()
    k = np.arange(6000)
    for one in streams.values():
        one.stamp[:] = EPOCH + (k // 5 * 5 + 4) * 10_000_000 + k % 5 * 100_000
    with pytest.raises(
        RecordingError, match=r"bursts of about 5, 0.1 ms apart, every 49.6 ms: they are times of arrival"
    ):
        run_of(streams)


@pytest.mark.parametrize(
    "which", [slice(0, 200), slice(3000, 3008), slice(3000, 3045), slice(2000, 2300), slice(5700, None)]
)
@pytest.mark.parametrize("channel", [0, slice(None)])
def test_a_channel_that_is_lost_for_a_while_is_left_out_and_named(which: slice, channel: int | slice) -> None:
    streams = recording()
    streams["wrench"].values[which, channel] = 0.0
    run = run_of(streams)
    lost = told(run, "dropout")
    assert [loss.where[-2:] for loss in lost] == (["Fz"] if channel == 0 else ["Fz", "Ty"])
    first, stop, _ = which.indices(6000)
    assert lost[0].count == stop - first and lost[0].real
    assert (lost[0].start_s, lost[0].end_s) == pytest.approx((0.01 * first, 0.01 * (stop - 1)), abs=1e-6)
    assert error(run)[0] < 4.0 * NOISE
    kept = condense("test", streams.items(), CHANNELS, CondenseSettings(), keep_spikes=True)
    assert error(kept)[0] > 3.0 or first == 0 or stop == 6000
    assert told(kept, "dropout") == lost


def test_an_encoder_s_reading_that_is_lost_for_a_while_is_left_out() -> None:
    streams = recording()
    streams["angle"].values[3000:3040] = 3.0
    run = run_of(streams)
    assert [loss.count for loss in told(run, "dropout")] == [40]
    assert error(run)[1] < 1e-4


def test_what_is_predicted_is_nobody_s_reading_and_is_not_refused_for_what_no_reading_does() -> None:
    streams = recording()
    streams["wrench"].values[::2, 1] += 40.0
    with pytest.raises(RecordingError, match="two sources"):
        run_of(streams)
    predicted = condense("test", streams.items(), CHANNELS, CondenseSettings(), keep_spikes=True)
    assert predicted.wrench is not None and np.ptp(predicted.wrench.values[500:-500, 1]) > 11.0


@pytest.mark.parametrize("key", ["wrench", "angle"])
@pytest.mark.parametrize("share", [0.05, 0.15, 0.5])
def test_readings_that_are_lost_all_the_time_are_no_signal(key: str, share: float) -> None:
    streams = recording()
    streams[key].values[np.random.default_rng(5).random(6000) < share] = 0.0 if key == "wrench" else 3.0
    with pytest.raises(RecordingError, match=r"that is no signal|two sources are in one stream"):
        run_of(streams)


@pytest.mark.parametrize(("key", "by"), [("wrench", 20.0), ("angle", -0.7)])
def test_a_count_that_is_lost_behind_a_short_gap_is_refused(key: str, by: float) -> None:
    streams = recording()
    streams[key].values[4000:, 0] += by
    streams[key] = rows(streams[key], np.delete(np.arange(6000), np.arange(3990, 4005)))
    with pytest.raises(RecordingError, match=r"steps by .* 39\.89 s after the first, and stays there"):
        run_of(streams)


@pytest.mark.parametrize("missing", [1, 29])
def test_a_bad_sample_beside_a_gap_is_interpolated(missing: int) -> None:
    streams = recording()
    streams["wrench"].values[3000] = 0.0
    streams["wrench"] = rows(streams["wrench"], np.delete(np.arange(6000), np.arange(3001, 3001 + missing)))
    run = run_of(streams)
    assert [loss.count for loss in told(run, "spike")] == [1, 1]
    assert error(run)[0] < 4.0 * NOISE


def test_a_push_of_a_moment_stays() -> None:
    streams = recording()
    streams["wrench"].values[3000:3020] += np.random.default_rng(1).normal(20.0, 1.0, (20, 1))
    run = run_of(streams)
    assert run.losses == () and run.wrench is not None
    assert np.abs(run.wrench.values - truth(run.wrench.t))[run.wrench.valid].max() > 10.0


def test_parts_of_a_second_without_their_leading_zeros_are_refused() -> None:
    streams = recording()
    for one in streams.values():
        part = np.arange(6000) % 100 * 10  # ms
        one.stamp[:] = (
            EPOCH + np.arange(6000) // 100 * 1_000_000_000 + np.where(part < 100, 10 * part, part) * 1_000_000
        )
        one.log[:] = one.stamp
    with pytest.raises(RecordingError, match="without their leading zeros"):
        run_of(streams)


@pytest.mark.parametrize("seed", range(3))
def test_many_gaps_among_jitter_are_one_line_and_none_of_them_is_of_no_sample(seed: int) -> None:
    rng = np.random.default_rng(seed)
    line = Timeline("test: camera", ("x",), bridged=0.0)
    t = (np.arange(600) + rng.normal(0.0, 0.1, 600))[rng.random(600) > 0.03]
    stamp = EPOCH + np.sort((t * 1e9).astype(np.int64))
    line.push(Block(stamp, stamp, np.zeros((len(stamp), 1))))
    line.flush()
    (gaps,) = [loss for loss in line.losses(0.0, 1.0) if loss.kind == "gap"]
    assert abs(gaps.count - (600 - len(stamp))) <= 3
    assert gaps.detail == f"{line.gap_count} gaps" and all(gap.missing for gap in line.gaps)


def jitter(streams: dict[str, Block], late: np.ndarray) -> dict[str, Block]:
    for one in streams.values():
        one.stamp[:] = np.maximum.accumulate(one.stamp + np.rint(1e9 * late).astype(np.int64))
        one.log[:] = one.stamp
    return streams


def test_stamps_that_jitter_make_no_bad_samples() -> None:
    rng = np.random.default_rng(11)
    for late in (rng.normal(0.0, 1e-3, 6000), rng.uniform(0.0, 1e-2, 6000)):
        found = {loss.kind for loss in run_of(jitter(recording(), late)).losses}
        assert found <= {"gap"}


@pytest.mark.parametrize("mean", [4e-3, 1e-2])
def test_times_of_arrival_are_refused_by_name(mean: float) -> None:
    streams = jitter(recording(), np.random.default_rng(11).exponential(mean, 6000))
    with pytest.raises(RecordingError, match=r"off a regular rate: they are times of arrival, or samples"):
        run_of(streams)


@pytest.mark.parametrize("noise", [0.02, 0.1, 0.3, 1.0])
def test_readings_undecided_between_neighbouring_codes_are_sound(noise: float) -> None:
    streams = recording()
    values = streams["wrench"].values
    rng = np.random.default_rng(3)
    values[:] = 0.05 * np.rint((0.1 * values + 0.025 + rng.normal(0.0, 0.05 * noise, values.shape)) / 0.05)
    angle = streams["angle"].values
    angle[:] = 1e-3 * np.rint((angle + rng.normal(0.0, 1e-3 * noise, angle.shape)) / 1e-3)
    assert run_of(streams).losses == ()


@pytest.mark.parametrize("by_chance", [True, False])
def test_two_sources_that_stamp_alike_are_refused(by_chance: bool) -> None:
    streams = recording()
    wrench = streams["wrench"]
    order = np.argsort(np.repeat(np.arange(6000.0), 2) + 0.1 * np.random.default_rng(1).random(12_000) * by_chance)
    both = [
        np.stack([one, other], axis=1).reshape(12_000, -1)[order]
        for one, other in ((wrench.stamp, wrench.stamp), (wrench.log, wrench.log), (wrench.values, 0.0 * wrench.values))
    ]
    streams["wrench"] = Block(both[0][:, 0], both[1][:, 0], both[2].reshape(12_000, 2))
    with pytest.raises(RecordingError, match="two sources are in one stream"):
        run_of(streams)


def test_a_temperature_s_bad_sample_is_interpolated_and_its_steps_stay() -> None:
    streams = recording()
    t = np.arange(600) * 0.1
    stamp = EPOCH + np.rint(1e9 * t).astype(np.int64)
    true = 0.0625 * np.rint((20.0 + 0.02 * t + 3.0 * (t > 40.0)) / 0.0625)
    values = true.copy()
    values[200] = 85.0  # what a sensor says that has not measured yet
    channels = {**CHANNELS, "temperature": ("bearing",)}
    streams["temperature"] = Block(stamp, stamp + 1000, values[:, None])
    run = condense("test", streams.items(), channels, CondenseSettings())
    (spike,) = told(run, "spike")
    assert spike.where == "test: temperature, bearing" and spike.start_s == pytest.approx(20.0, abs=1e-3)
    assert run.temperature is not None
    np.testing.assert_allclose(run.temperature.values[::2, 0], true[: len(run.temperature.values[::2])], atol=0.1)


@pytest.mark.parametrize("lasts", [1.0, 3.0, 10.0, 30.0])  # samples
@pytest.mark.parametrize("frequency", [0.0, 0.1, 1.0 / 3.0, 0.47])  # of the sampling rate
def test_a_blow_that_dies_away_stays(lasts: float, frequency: float) -> None:
    streams = recording()
    k = np.arange(300)
    blow = 20.0 * np.exp(-k / lasts) * np.cos(2.0 * np.pi * frequency * k)
    streams["wrench"].values[3000:3300] += blow[:, None] * np.array([1.0, 0.5])
    run = run_of(streams)
    cut = sum(loss.count for loss in run.losses if loss.kind in ("spike", "dropout"))
    assert cut == 0 or lasts < 2.0
    assert {loss.kind for loss in run.losses} <= {"spike", "blow"}
