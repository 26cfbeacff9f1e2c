"""What samples can show: distinct readings a second, steps, gaps, and bands next to an amplifier's corner."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import archived
from kbs_process.errors import ConfigError
from kbs_process.reduction.measurable import amplified, attenuated, check_requirements, doubtful, hidden, unrecorded
from kbs_process.rig.model import Amplifier, Quantity
from kbs_process.signals.records import COPY, WRENCH_CHANNELS, WRENCH_UNITS, Block, Loss, Signal, Stretch
from kbs_process.stages.align.readings import Readings

NEEDED = 2.5  # Hz: a band up to 1 Hz


def read(t: np.ndarray, values: np.ndarray, piece: int = 700) -> Readings:
    """The readings of a stream at times t (n,) s, taken in by pieces."""
    readings = Readings()
    stamp = np.round(1e9 * t).astype(np.int64)
    for at in range(0, len(t), piece):
        rows = slice(at, at + piece)
        readings.push(Block(stamp[rows], stamp[rows], values[rows]))
    return readings


def noise(n: int, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).normal(0.0, 0.02, (n, 6)) + np.sin(np.arange(n) / 300.0)[:, None]


def slow(readings: Readings) -> tuple[float, float]:
    return readings.slow(NEEDED, at_rest=False)


def test_a_fast_stream_shows_its_band():
    t = np.arange(0.0, 120.0, 0.01)
    assert slow(read(t, noise(len(t)))) == (0.0, 0.0)


@pytest.mark.parametrize("rate", [1.0, 1.5])
def test_a_slow_stream_does_not(rate):
    t = np.arange(0.0, 240.0, 1.0 / rate)
    assert slow(read(t, noise(len(t)))) == pytest.approx((1.0, rate), rel=0.1)


def test_rows_that_share_a_stamp_are_one_reading():
    t = np.floor(np.arange(0.0, 120.0, 0.01))
    assert slow(read(t, noise(len(t)))) == pytest.approx((1.0, 1.0), rel=0.2)


def test_readings_that_a_logger_repeats_are_one():
    t = np.arange(0.0, 120.0, 0.01)
    held = noise(120)[(t + 1e-6).astype(int)]
    assert slow(read(t, held)) == pytest.approx((1.0, 1.0), rel=0.2)


def test_a_stretch_of_repeated_readings_is_found():
    t = np.arange(0.0, 120.0, 0.01)
    values = noise(len(t))
    values[3000:6000] = values[3000:6000][np.arange(3000) // 100 * 100]
    share, rate = slow(read(t, values))
    assert (share, rate) == pytest.approx((0.25, 1.0), rel=0.3)


def test_what_rounding_repeats_at_rest_is_no_repeat():
    t = np.arange(0.0, 120.0, 0.01)
    steps = np.round(noise(len(t)) * 0.3 / 0.02) * 0.02
    assert slow(read(t, steps)) == (0.0, 0.0)


def test_the_step_of_a_channel_is_read_from_its_readings():
    values = noise(3000)
    values[:, 4] = np.round(values[:, 4] / 0.05) * 0.05
    steps = read(np.arange(3000) * 0.01, values).steps()
    assert steps[4] == pytest.approx(0.05)
    assert np.all(np.delete(steps, 4) == 0.0)


def test_an_amplifier_that_takes_much_off_forbids_a_verdict():
    amplifier = Amplifier(2, Quantity("corner", np.array(20.0), "Hz", np.array(0.2), "test"))
    assert not list(attenuated(amplifier, 1.0)) and not list(attenuated(None, 50.0))
    (doubt,) = attenuated(amplifier, 20.0)
    assert "29 %" in doubt.why and not doubt.of_failed


def test_a_resonance_next_to_a_band_forbids_a_verdict():
    assert not list(amplified([6.0, 10.0], 1.0)) and not list(amplified([], 1.0))
    assert len(list(amplified([6.0, 10.0], 5.0))) == 1


def test_axes_that_are_not_recorded_forbid_a_verdict():
    campaign = archived.campaign("EL089", recordings=False)
    rig, (asked, *_) = campaign.rig, campaign.requirements
    asked = replace(asked, frame="T")
    assert not list(unrecorded(asked, rig))
    some = replace(rig, transducer=replace(rig.transducer, channels=("Fx", "Fz", "Ty")))
    (doubt,) = unrecorded(asked, some)
    assert doubt.why.startswith("not recorded: Tx, Tz") and not doubt.of_failed


def test_calibrations_alone_are_refused_where_something_is_required():
    campaign = archived.campaign("EL089", recordings=False)
    check_requirements(campaign)
    alone = replace(campaign, recordings=tuple(replace(one, role="calibration") for one in campaign.recordings))
    with pytest.raises(ConfigError, match="no recording is judged"):
        check_requirements(alone)
    check_requirements(replace(alone, requirements=()))


def doubts(
    gaps: list[tuple[float, float]],
    known: slice | np.ndarray = slice(20, -20),
    unclear: tuple[Stretch, ...] = (),
    rate: float = 20.0,
    streams: dict[str, Readings] | None = None,
) -> list[str]:
    """Why EL089's requirement, up to 1 Hz, is not judged by two minutes with gaps, s, where they are `known`."""
    campaign = archived.campaign("EL089", recordings=False)
    valid = np.zeros(2400, dtype=bool)
    valid[known] = True
    values = noise(2400)
    loads = Signal(0.0, 0.05, values, WRENCH_CHANNELS, WRENCH_UNITS, "T", valid)
    run = SimpleNamespace(
        loads=loads, gaps=np.array(gaps).reshape(-1, 2), losses=(), rates={"angle": rate}, stretches=unclear, reach=1.0
    )
    found = hidden(campaign, campaign.requirements[0], "test", run, valid, streams or {"angle": Readings()})
    return [one.why for one in found if streams or not one.of_failed]


def test_held_readings_need_more_a_second_than_those_that_come_once() -> None:
    t = np.arange(0.0, 120.0, 0.01)
    held = {rate: noise(len(t))[np.arange(len(t)) // (100 // rate) * (100 // rate)] for rate in (5, 10)}
    (why,) = doubts([], streams={"wrench": read(t, held[5])}, rate=100.0)
    assert why == ("readings of wrench are new only 5 times a second in 100 % of test, and a band up to 1 Hz needs 8")
    assert doubts([], streams={"wrench": read(t, held[10])}) == []
    assert doubts([], streams={"wrench": read(t[::20], held[5][::20])}, rate=5.0) == []


def test_what_a_gap_may_hide_is_not_judged_and_a_few_lost_samples_are():
    assert doubts([]) == [] and doubts([(20.0, 20.02), (80.0, 80.12)]) == []
    assert doubts([(0.0, 0.5), (119.5, 119.9)]) == []  # before what is known, and after
    (why,) = doubts([(20.0, 20.02), (60.0, 60.2), (70.0, 72.0)])
    assert why.startswith("readings or angles are missing in test, from 70.00 s to 72.00 s at the longest")
    assert len(doubts([(60.0, 60.2)])) == 1
    (why,) = doubts([], slice(20, 1440))
    assert why == "in 41 % of test readings or angles are missing"


def test_ends_of_a_slow_stream_lack_nothing_where_each_of_its_readings_is_known():
    known = np.arange(2400) % 4 == 0
    known[100:-100] = True
    assert doubts([], known, rate=5.0) == []
    assert doubts([], known) == ["in 6 % of test readings or angles are missing"]
    known[:200] = False
    (why,) = doubts([], known, rate=5.0)
    assert why == "in 8 % of test readings or angles are missing"


def test_readings_that_are_missing_for_what_may_have_happened_forbid_met():
    lost = [Stretch("gap", at, 0.03, likely=True) for at in (20.0, 50.0, 0.1)]  # the last before what is known
    (why,) = doubts([(20.0, 20.04), (50.0, 50.04)], unclear=tuple(lost))
    assert why.startswith(
        "readings are missing in test, 2 times, for 0.03 s at 20.00 s: what happened may be the cause"
    )
    for kind in ("spike", "dropout"):  # judged with it and without it
        assert doubts([], unclear=(Stretch(kind, 20.0, 0.03, likely=True),)) == []


def unclear(
    amplifier: bool,
    *starts: list[float],
    length: float = 0.03,
    likely: bool = False,
    kind: str = "gap",
    losses: tuple[Loss, ...] = (),
) -> list[int]:
    """How many of the stretches that begin at `starts`, of each repeat, may be what happened."""
    campaign = archived.campaign("EL089", recordings=False)
    transducer = campaign.rig.transducer if amplifier else replace(campaign.rig.transducer, amplifier=None)
    campaign = replace(campaign, rig=replace(campaign.rig, transducer=transducer))
    loads = Signal(0.0, 0.05, np.zeros((2400, 1)), ("Ty",), ("N m",), "T", np.ones(2400, dtype=bool))
    turn = np.cumsum(np.sin(np.arange(2400) / 300.0))[:, None]
    recordings = []
    for number, own in enumerate(starts):
        late = 1.3 * number
        moved = Signal(late, 0.05, turn, ("arm",), ("rad",), "joint", np.ones(2400, dtype=bool))
        stretches = tuple(Stretch(kind, at + late, length, likely) for at in own)
        run = SimpleNamespace(
            loads=loads,
            stretches=stretches,
            command=None,
            angle=moved,
            wrench=loads,
            losses=losses[:number],
            load_rates=[100.0],
        )
        recordings.append((SimpleNamespace(name=str(number), trajectory="same"), run))
    return [len(own) for own in doubtful(campaign, recordings, 1.0).values()]


def test_what_repeats_lack_at_the_same_instant_they_lack_for_a_reason():
    assert unclear(False, [20.0, 30.0], [20.0, 70.0], kind="spike") == [1, 1]
    assert unclear(False, [20.0, 30.0], [21.3, 70.0], kind="spike") == [0, 0]
    assert unclear(False, [20.0], [20.0], kind="spike", losses=(Loss(COPY, "", 0),)) == [0, 0]  # which is no repeat
    often = [list(np.random.default_rng(seed).uniform(0.0, 120.0, 200)) for seed in (1, 2)]
    assert unclear(False, *often) == [0, 0]  # no more than by chance
    assert unclear(True, [20.0], [20.0], kind="spike", length=0.01) == [0, 0]  # nothing so short passes 20 Hz


def test_what_an_amplifier_passes_and_the_band_shows_may_be_what_happened():
    assert unclear(False, [20.0], likely=True) == [1] == unclear(True, [20.0], likely=True)
    assert unclear(True, [20.0], likely=True, length=0.01) == [0]  # 20 Hz pass nothing so short
    assert unclear(False, [20.0], kind="spike", length=0.2) == [0]
    assert unclear(False, [20.0], kind="spike", length=0.25) == [1]  # of a band up to 1 Hz


def test_missing_rows_that_stand_alone_may_hide_what_happened_and_those_of_a_logger_do_not() -> None:
    assert unclear(False, [20.0]) == [1] == unclear(False, [20.0], length=0.1)
    assert unclear(False, [20.0], length=0.02) == [0]  # too brief for a band up to 1 Hz
    assert unclear(False, [20.0, 30.0, 50.0]) == [0]  # as often as that they have another cause
    assert unclear(False, [20.0, 30.0, 50.0], likely=True) == [3]
    assert unclear(False, [20.0], length=0.02, likely=True) == [1]
