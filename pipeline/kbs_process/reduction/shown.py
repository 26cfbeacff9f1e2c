"""What the samples of a recording can show: how many distinct readings there are, where, and in what steps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from kbs_process.campaign.config import Campaign, Requirement
from kbs_process.reduction.measurable import judged_channels
from kbs_process.results.judged import Doubt
from kbs_process.rig.model import Amplifier
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Block, Mask, Run
from kbs_process.stages.align.condense import LOADS

SHOWN = 0.4  # of the rate of distinct readings: the highest frequency that they show
UNSEEN = 0.05  # share of a recording that may be unknown: an interval at 95 % leaves out as much
AMPLIFIED = 0.05  # part of a reading that an amplifier may take off at a band's upper edge
_BIN = 0.25  # s
_COUNTED = 20  # readings that tell a local rate
_SHORT = 0.9  # of the readings that are needed: as many are enough, at the ends of a window some are missed
_HEAD = 4096  # rows that tell in which steps a channel reads
_STEPS = 4.0  # a channel that changes by more of its steps at a time is not at rest
_ON_GRID = 0.02  # of a step


@dataclass(slots=True)
class Readings:
    """The readings of one stream: how many in each quarter of a second, and the first of them."""

    stamped: dict[int, int] = field(default_factory=dict)  # by quarter: with a stamp of their own
    changed: dict[int, int] = field(default_factory=dict)  # and not the same as the one before
    head: list[Array] = field(default_factory=list)
    _rows: int = 0
    _last: tuple[int, Array] | None = None

    def push(self, block: Block) -> None:
        """Count a block's readings; stamps that never advance are the recorder's."""
        stamp = block.stamp if len(block) < 2 or block.stamp[0] != block.stamp[-1] else block.log
        stamp, at = np.unique(stamp, return_index=True)
        values = block.values[at]
        if self._last is not None and stamp[0] == self._last[0]:
            stamp, values = stamp[1:], values[1:]
        if len(stamp) == 0:
            return
        before = values[:1] + np.nan if self._last is None else self._last[1]
        rows = np.concatenate([before, values])
        new = ~np.all((rows[1:] == rows[:-1]) | (np.isnan(rows[1:]) & np.isnan(rows[:-1])), axis=1)
        self._last = int(stamp[-1]), values[-1:].copy()
        quarter = stamp // int(1e9 * _BIN)
        for counts, which in ((self.stamped, quarter), (self.changed, quarter[new])):
            for place, count in zip(*np.unique(which, return_counts=True), strict=True):
                counts[int(place)] = counts.get(int(place), 0) + int(count)
        if self._rows < _HEAD:
            self.head.append(values[: _HEAD - self._rows].copy())
            self._rows += len(self.head[-1])

    def steps(self) -> Array:
        """The step (c,) in which each channel reads, as its first readings show; zero of one that has none."""
        rows = np.concatenate(self.head) if self.head else np.zeros((0, 0))
        return np.array([_step(column) for column in rows.T])

    def slow(self, needed: float, *, at_rest: bool) -> tuple[float, float]:
        """Share of the time in which there are fewer than `needed` distinct readings a second, and the rate there.

        Readings `at_rest` may be the same by rounding. Time without any change is none of it.
        """
        counts = self.stamped if at_rest or self._rounded() else self.changed
        if not counts:
            return 0.0, 0.0
        first, last = min(self.stamped), max(self.stamped)
        length = min(max(1, round(_COUNTED / needed / _BIN)), last - first + 1)
        windows: dict[int, int] = {}
        for place, count in counts.items():
            windows[(place - first) // length] = windows.get((place - first) // length, 0) + count
        windows.pop((last - first + 1) // length, None)  # the last one is not whole
        rates = np.array(list(windows.values())) / (length * _BIN)
        low = rates[rates < _SHORT * needed]
        return (len(low) / len(rates), float(np.median(low))) if len(low) else (0.0, 0.0)

    def _rounded(self) -> bool:
        """Whether all channels change by steps of their rounding, so that the same reading may well come again."""
        rows = np.concatenate(self.head)
        for column, step in zip(rows.T, self.steps(), strict=True):
            change = np.abs(np.diff(column))
            change = change[np.isfinite(change) & (change > 0.0)]
            if len(change) and (step == 0.0 or np.median(change) > _STEPS * step):
                return False
        return True


def _step(x: Array) -> float:
    """The largest step of which all readings are multiples apart; zero where there is none."""
    levels = np.unique(x[np.isfinite(x)])
    apart = np.diff(levels)
    apart = apart[apart > 1e-9 * max(float(np.ptp(levels)), 1e-300)] if len(levels) > 2 else apart[:0]
    if len(apart) == 0:
        return 0.0
    step = float(apart.min())
    multiples = (levels - levels[0]) / step
    return step if np.all(np.abs(multiples - np.rint(multiples)) < _ON_GRID) else 0.0


class Watch:
    """Passes the blocks of a recording on, and counts their readings, stream by stream."""

    def __init__(self) -> None:
        self.streams: dict[str, Readings] = {}

    def __call__(self, blocks: Iterator[tuple[str, Block]]) -> Iterator[tuple[str, Block]]:
        """Yield the blocks as they are."""
        for key, block in blocks:
            if key in (*LOADS, "angle") and len(block):
                self.streams.setdefault(key, Readings()).push(block)
            yield key, block


def hidden(
    campaign: Campaign, requirement: Requirement, name: str, run: Run, moving: Mask, streams: Mapping[str, Readings]
) -> Iterator[Doubt]:
    """Yield what a recording's samples cannot show of a requirement; `moving` (n,): where its angles are known."""
    rig, edge = campaign.rig, requirement.band[1]
    judged = judged_channels(requirement, rig)
    channels = WRENCH_CHANNELS if requirement.frame == "S" else judged
    needed = edge / SHOWN
    for key, readings in streams.items():
        share, rate = readings.slow(needed, at_rest=key == "angle")
        if share > UNSEEN:
            stream = "encoder" if key == "angle" else key
            yield Doubt(
                f"{stream} has {rate:.3g} distinct readings a second in {100.0 * share:.0f} % of {name}, and a band up "
                f"to {edge:g} Hz needs {needed:.3g}"
            )
    loads = run.loads
    assert loads is not None  # every recording that is judged has some
    known = loads.valid & moving
    inside = known[np.argmax(known) : len(known) - np.argmax(known[::-1])] if known.any() else known
    if len(inside) and (missing := 1.0 - float(np.mean(inside))) > UNSEEN:
        yield Doubt(f"in {100.0 * missing:.0f} % of {name} wrench or angles are missing", of_failed=False)
    if coarse := [one for one in _coarse(campaign, streams) if one[0] in channels]:
        steps = ", ".join(f"{channel} in steps of {step:.3g} {unit}" for channel, unit, step in coarse)
        yield Doubt(f"{steps} in {name}: coarser than the resolution that is stated")
    held = sorted({loss.where for loss in run.losses if loss.kind == "held" and loss.where in channels})
    if held:
        yield Doubt(f"{', '.join(held)} held one reading in {name}: what was beyond is not known", of_failed=False)


def rounding(campaign: Campaign, streams: Mapping[str, Readings]) -> dict[str, float]:
    """Standard deviation, by channel, of readings that are rounded more coarsely than is stated."""
    return {channel: step / float(np.sqrt(12.0)) for channel, _, step in _coarse(campaign, streams)}


def _coarse(campaign: Campaign, streams: Mapping[str, Readings]) -> Iterator[tuple[str, str, float]]:
    """Channels of the wrench that read in greater steps than is stated, and than their noise hides."""
    rig = campaign.rig
    if "wrench" not in streams:
        return
    index = rig.loads.index(rig.transducer.channels)
    noise, stated = rig.transducer.noise.value[index], rig.transducer.resolution.value[index]
    for column, step in enumerate(streams["wrench"].steps()):
        if step > max(2.0 * noise[column], 1.5 * stated[column]):
            yield rig.transducer.channels[column], rig.loads.units[index[column]], float(step)


def attenuated(amplifier: Amplifier | None, edge: float) -> Iterator[Doubt]:
    """Yield a doubt where the amplifier takes more off at a band's upper edge than may be left uncorrected."""
    if amplifier is None:
        return
    lost = 1.0 - 1.0 / np.sqrt(1.0 + (edge / float(amplifier.corner)) ** (2 * amplifier.order))
    if lost > AMPLIFIED:
        yield Doubt(
            f"the amplifier takes {100.0 * lost:.0f} % off at {edge:g} Hz, the band's upper edge", of_failed=False
        )


def amplified(frequencies: Sequence[float], edge: float) -> Iterator[Doubt]:
    """Yield a doubt where a resonance is so near to a band that what it amplifies is no error, but the signal.

    `budget.resonance` holds for modes above the band's upper edge by half an octave.
    """
    lowest = min(frequencies, default=np.inf)
    if 2.0 * edge**2 > lowest**2:
        yield Doubt(f"the resonance at {lowest:.3g} Hz lies in or next to a band up to {edge:g} Hz")
