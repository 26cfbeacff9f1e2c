"""Readings that were drawn between others have no noise: they are left out, or told where a verdict keeps them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import archived
from kbs_process.campaign.config import RecordingEntry
from kbs_process.reduction.held import Alive
from kbs_process.signals.records import Array, Block, Loss

ENTRY = RecordingEntry("a", Path("recordings/a.mcap"), "SWING", "fit", 1, None, None, None)
DRAWN = slice(900, 1100)
TY = 4


def passed(values: Array, *, keep: bool = False, piece: int = 70) -> tuple[set[int], tuple[Loss, ...]]:
    """Which of EL089's readings at 100 Hz are left out, and what is told."""
    rig = archived.campaign("EL089", recordings=False).rig
    alive, stamp = Alive(rig, ENTRY, keep=keep), np.arange(len(values)) * 10_000_000
    pieces = (slice(start, start + piece) for start in range(0, len(values), piece))
    kept = [block.stamp for _, block in alive(("wrench", Block(stamp[own], stamp[own], values[own])) for own in pieces)]
    return set(range(len(values))) - set((np.concatenate(kept) // 10_000_000).tolist()), alive.losses


def swing(noise: float = 1.0) -> Array:
    """Twenty seconds with noise as stated, on what moves slowly."""
    own = archived.campaign("EL089", recordings=False).rig.transducer.noise.value
    t = np.arange(2000) * 0.01
    return np.sin(0.5 * t)[:, None] + noise * own * np.random.default_rng(1).standard_normal((2000, 6))


def drawn(values: Array, curve: str) -> Array:
    filled, at = values.copy(), np.arange(DRAWN.start, DRAWN.stop)
    ends = np.array([DRAWN.start - 1, DRAWN.stop])
    if curve == "line":
        filled[at, TY] = np.interp(at, ends, values[ends, TY])
    else:
        s = (at - ends[0]) / (ends[1] - ends[0])
        filled[at, TY] = values[ends[0], TY] + np.ptp(values[ends, TY]) * s + 0.1 * s * (1.0 - s)
    return filled


@pytest.mark.parametrize("piece", [70, 2000])
@pytest.mark.parametrize("decimals", [5, 15])
@pytest.mark.parametrize("curve", ["line", "parabola"])
def test_what_is_drawn_is_left_out_and_told(curve: str, decimals: int, piece: int) -> None:
    values = np.round(drawn(swing(), curve), decimals)
    gone, (loss,) = passed(values, piece=piece)
    assert set(range(DRAWN.start, DRAWN.stop)) <= gone <= set(range(DRAWN.start - 4, DRAWN.stop + 4))
    assert loss.where == "Ty" and "drawn between others, not measured" in loss.detail
    gone, (loss,) = passed(values, keep=True, piece=piece)
    assert not gone and "drawn between others" in loss.detail


@pytest.mark.parametrize("piece", [70, 2000])
def test_readings_that_a_logger_repeats_in_all_channels_are_missing_for_as_long(piece: int) -> None:
    """Also where a channel that is cut off is judged: a load holds no six channels at once."""
    values = swing()
    values[DRAWN] = values[DRAWN.start]
    gone, losses = passed(values, keep=True, piece=piece)
    assert gone == set(range(DRAWN.start, DRAWN.stop)) and losses == ()


@pytest.mark.parametrize("decimals", [3, 5, 15])
@pytest.mark.parametrize("noise", [1.0, 0.0])
def test_noise_as_stated_and_none_at_all_are_not_drawn(noise: float, decimals: int) -> None:
    assert passed(np.round(swing(noise), decimals), keep=True) == (set(), ())


def test_a_stretch_that_is_still_beside_one_that_shakes_is_not_drawn() -> None:
    values = np.round(swing(), 4)
    values[:1000] = np.round(swing(0.3)[:1000], 4)
    assert passed(values) == (set(), ())
