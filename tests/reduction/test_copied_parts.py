"""A part of a recording that is that of another one, or comes twice in it: noise does not repeat."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import butter, lfilter

import archived
from kbs_process.reduction.soundness.streams import copied
from kbs_process.signals.records import WRENCH_CHANNELS, Block, Signal
from kbs_process.stages.align.prints import Printed, Prints
from kbs_process.stages.align.readings import Watch
from kbs_process.stages.align.spectrum import Welch

RATE, TY = 100.0, 4


def noise(seed: int) -> np.ndarray:
    """A minute as EL089's transducer reads it at rest, to a microunit."""
    own = archived.campaign("EL089", recordings=False).rig.transducer.noise.value
    return np.round(np.random.default_rng(seed).normal(0.0, own, (6000, 6)), 6)


def found(*recordings: np.ndarray, roles: tuple[str, ...] = ("held-out", "held-out")) -> list[str]:
    """What is told of recordings that come in small pieces."""
    campaign = archived.campaign("EL089", recordings=False)
    prepared = []
    for place, values in enumerate(recordings):
        stamp = np.round(np.arange(len(values)) * 1e9 / RATE).astype(np.int64)
        pieces = [slice(at, at + 70) for at in range(0, len(values), 70)]
        watch, printed = Watch(), Printed()
        for _ in printed(watch(("wrench", Block(stamp[own], stamp[own], values[own])) for own in pieces)):
            pass
        loads = Signal(0.0, 0.05, values[::5], ("Ty",) * 6, ("N m",) * 6, "T", np.ones(len(values[::5]), dtype=bool))
        welch = Welch(RATE, 0.1, 100.0, WRENCH_CHANNELS)
        welch.push(values, None)
        told = {"spectrum": welch.result(), "rates": {"wrench": RATE}, "epoch_ns": 0}
        run = SimpleNamespace(loads=loads, command=None, wrench=loads, angle=loads, rate=None, **told)
        entry = SimpleNamespace(
            name="abc"[place] if len(recordings) < 4 else f"{place}", role=(*roles, "fit")[place % 3]
        )
        prepared.append(SimpleNamespace(entry=entry, run=run, readings=watch.streams, prints=printed.channels))
    return [doubt.why for doubt in copied(campaign.requirements[0], campaign.rig, prepared)]


@pytest.mark.parametrize("columns", [[TY], list(range(6))])
def test_a_part_of_another_recording_is_found_at_any_offset(columns):
    first, second = noise(1), noise(2)
    assert found(first, second) == []
    second[3013:3213, columns] = first[1000:1200, columns]
    (why,) = found(first, second)
    assert "Ty" in why and " in b, from 30." in why and "s to 31." in why and "come in a as well" in why
    assert len(found(first, second, roles=("calibration", "held-out"))) == 1
    assert found(first, second, roles=("calibration", "calibration")) == []


@pytest.mark.parametrize("step", [1e-6, 1e-4])
def test_a_part_that_is_turned_round_in_time_is_found(step):
    first, second = noise(1), noise(2)
    second[3013:3313] = np.round(first[1000:1300][::-1] / step) * step
    (why,) = found(first, second)
    assert "Ty" in why and " in b, from 30." in why and "s to 32." in why and "come in a as well" in why


def test_what_is_smooth_may_be_the_same_by_chance():
    """Filtered below a hertz and rounded to a microunit, at rest; and a straight line that somebody drew."""
    still = [np.round(lfilter(*butter(2, 0.3, fs=RATE), noise(seed), axis=0), 5) for seed in (1, 2)]
    assert found(*still) == []
    first, second = noise(1), noise(2)
    for values in (first, second):
        values[3000:3400] = np.round(np.linspace(values[3000], values[3400], 400), 6)
    assert found(first, second) == []


def test_a_part_that_comes_again_in_the_same_recording_is_found():
    values = noise(3)
    values[4001:4301] = values[1000:1300]
    (why,) = found(values)
    assert "in a, from 40." in why and "come at another time of it" in why


@pytest.mark.parametrize(
    "rounded",
    [
        lambda x: x.astype(np.float32).astype(np.float64),
        lambda x: np.round(x, 5),
        lambda x: np.round(x, 4),
        lambda x: np.round(x + 0.123, 5),  # tared anew
    ],
)
def test_a_copy_that_is_rounded_anew_is_found(rounded):
    first, second = noise(1), noise(2)
    second[3013:3313, TY] = rounded(first[1000:1300, TY])
    (why,) = found(first, second)
    assert "readings of Ty in b, from 30." in why and "come in a as well" in why
    (why,) = found(first, rounded(first))
    assert "readings of Fx, Fy, Fz, Tx, Ty, Tz in b, from 0." in why and "s to 59." in why


@pytest.mark.parametrize("step", [1e-9, 1e-6, 1e-5, 1e-4])
def test_repeats_of_a_quiet_rig_are_no_copies(step):
    def repeat(seed: int) -> np.ndarray:
        t = np.arange(6000)[:, None] / RATE
        moved = 5.0 * np.sin(0.5 * t) + 0.05 * np.sin(2.0 * np.pi * 23.0 * t)
        return np.round((moved + 0.03 * noise(seed)) / step) * step

    assert found(repeat(1), repeat(2), repeat(3)) == []


def test_prints_of_a_long_recording_take_no_more_memory_and_find_a_copy_among_many():
    prints = Prints()
    x = np.random.default_rng(1).standard_normal(1_000_000)
    for at in range(0, len(x), 50_000):
        prints.push(np.arange(at, at + 50_000), x[at : at + 50_000])
    assert prints.words.nbytes + prints.at.nbytes + prints.runs.nbytes < 350_000
    others = [noise(seed) for seed in range(9)]
    (why,) = found(*others, others[7] + 1.0)
    assert "in 9, from 0." in why and "come in 7 as well" in why


def test_readings_that_repeat_by_their_steps_and_recordings_that_are_the_same_are_no_part():
    for step in (0.0025, 0.004, 0.006, 0.01, 0.05):
        assert found(*(np.round(noise(seed) / step) * step for seed in (1, 2))) == []
    assert found(noise(1).repeat(4, axis=0), noise(2).repeat(4, axis=0)) == []  # as a logger repeats them
    assert found(noise(1), noise(1)) == []  # `told_copies` tells of it
