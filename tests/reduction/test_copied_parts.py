"""A part of a recording that is that of another one, or comes twice in it: noise does not repeat."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import archived
from kbs_process.reduction.soundness import copied
from kbs_process.signals.records import Block, Signal
from kbs_process.stages.align.prints import Printed
from kbs_process.stages.align.readings import Watch

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
        run = SimpleNamespace(loads=loads, command=None, wrench=loads, angle=loads, rate=None, epoch_ns=0)
        entry = SimpleNamespace(name="abc"[place], role=roles[place])
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


def test_a_part_that_comes_again_in_the_same_recording_is_found():
    values = noise(3)
    values[4001:4301] = values[1000:1300]
    (why,) = found(values)
    assert "in a, from 10." in why and "come at another time of it" in why


def test_readings_that_repeat_by_their_steps_and_recordings_that_are_the_same_are_no_part():
    coarse = [np.round(noise(seed) / 0.05) * 0.05 for seed in (1, 2)]
    assert found(*coarse) == []
    assert found(noise(1).repeat(4, axis=0), noise(2).repeat(4, axis=0)) == []  # as a logger repeats them
    assert found(noise(1), noise(1)) == []  # `told_copies` tells of it
