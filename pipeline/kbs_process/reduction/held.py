"""Readings that a transducer's channel holds although it has noise, saturated, cut off or dead; and drawn ones.

A channel holds a reading for longer than chance would have it: readings with noise sigma in steps of D are the same
with a probability of up to erf(D / (sqrt(8) sigma)). Where the noise is less than half a step, as stated or as readings
around show, they are coarse, and none is held. Where none show the noise, only half a second and more is held.
Readings that lie on a parabola to within their steps, for `HELD_S` and for longer than chance would have it, were drawn
between others: they have no noise, either. What is held or drawn is left out as if it were missing.
A joint's effort may be what was commanded, or zero behind a brake, and is not looked at.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from math import erf

import numpy as np

from kbs_process.campaign.config import Campaign, RecordingEntry
from kbs_process.errors import RecordingError
from kbs_process.reduction.reading import Through, read_run
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array, Block, Loss, Mask, Run
from kbs_process.stages.align.ordering import concatenate, select
from kbs_process.stages.align.readings import white

HELD_S = 0.5  # longer than any channel with noise shows one and the same reading, whatever its amplifier passes
FEW = 5  # times as many the same as a logger repeats each reading are held, if all around shows noise
CHANCE = 1e-9  # of a sample, that as many readings as are held are the same by it
FREE = 64  # readings that tell a channel's noise; as many are the same by chance at most
DEAD = 0.5  # share of a recording beyond which a channel that is held is no channel


def noisy(rig: Rig) -> dict[str, float]:
    """The noise of each recorded channel where it is greater than half its resolution: no reading stays the same."""
    index = rig.loads.index(rig.transducer.channels)
    noise, step = rig.transducer.noise.value[index], rig.transducer.resolution.value[index]
    stated = zip(rig.transducer.channels, noise.tolist(), step.tolist(), strict=True)
    return {name: sigma for name, sigma, least in stated if sigma > 0.0 and sigma >= 0.5 * least}


class Alive:
    """Passes the blocks of a recording on, without rows in which a channel is held; tells what it has left out.

    With `keep` it leaves out only where all channels are held at once, which no load does where they have shown noise
    before, and tells of all the rest: a peak that was cut off was no smaller.
    """

    def __init__(self, rig: Rig, entry: RecordingEntry, *, keep: bool = False) -> None:
        noise = noisy(rig)
        places = {place: name for place, name in enumerate(rig.transducer.channels) if name in noise}
        self._entry = entry
        self._stream = _Stream(places, {place: noise[name] for place, name in places.items()}, keep)

    def __call__(self, blocks: Iterator[tuple[str, Block]]) -> Iterator[tuple[str, Block]]:
        """Yield the blocks; raises RecordingError at the end where a channel was held for most of the time.

        Nothing is raised of what is kept: simulated recordings may have no noise.
        """
        for key, block in blocks:
            watched = key == "wrench" and self._stream.channels and len(block)
            yield key, self._stream.push(block) if watched else block
        if (last := self._stream.flush()) is not None:
            yield "wrench", last
        if not self._stream.keep:
            self._stream.check(self._entry)

    @property
    def losses(self) -> tuple[Loss, ...]:
        return tuple(self._stream.losses())


def read_alive(
    campaign: Campaign, entry: RecordingEntry, *, keep: bool = False, keep_spikes: bool = False, watch: Through = iter
) -> Run:
    """Read a recording without what its channels were held in, or with it (`keep`); its losses tell of that.

    All that is read goes through `watch` first. Raises RecordingError where a channel was held most of the time, and
    that is not kept.
    """
    alive = Alive(campaign.rig, entry, keep=keep)
    run = read_run(campaign, entry, lambda blocks: alive(watch(blocks)), keep_spikes=keep_spikes)
    return replace(run, losses=(*run.losses, *alive.losses))


@dataclass(slots=True)
class _Stream:
    """Rows wait until those of `HELD_S` behind them are there, and stay for as long to be looked at with later ones."""

    channels: Mapping[int, str]  # by column
    noise: Mapping[int, float]  # as stated
    keep: bool = False
    rows: int = 0
    first: int = 0  # ns
    counts: dict[int, int] = field(default_factory=dict)
    spans: dict[int, tuple[int, int]] = field(default_factory=dict)  # ns
    reading: dict[int, float] = field(default_factory=dict)
    drawn: set[int] = field(default_factory=set)
    step: dict[int, float] = field(default_factory=dict)  # the least that readings differed by
    own: dict[int, float] = field(default_factory=dict)  # the noise that readings show, at most
    repeats: float = np.inf  # rows of one reading of all channels
    _block: Block | None = None
    _done: int = 0  # rows of it that were passed on

    def push(self, block: Block) -> Block:
        if self._block is None and len(block):
            self.first = int(block.stamp[0])
        self._block = block if self._block is None else concatenate([self._block, block])
        return self._release(max(_least(self._block), FREE))

    def flush(self) -> Block | None:
        return None if self._block is None else self._release(0)

    def _release(self, kept: int) -> Block:
        block = self._block
        assert block is not None
        end = max(len(block) - kept, self._done)
        part = slice(self._done, end)
        gone = np.zeros(end - self._done, dtype=np.bool_)
        least = _least(block)
        new = np.flatnonzero(np.any(block.values[1:] != block.values[:-1], axis=1))
        self.repeats = min(self.repeats, float(np.median(np.diff(new)))) if len(new) > FEW else self.repeats
        every = {column: self._held(column, block.values[:, column], least) for column in self.channels}
        gone = np.logical_or.reduce([held[part] for held in every.values()])
        if self.keep:
            gone = np.logical_and.reduce(list(every.values())) & (len(every) > 1)
            if not every.keys() <= self.own.keys():  # nothing has shown noise as yet
                gone &= ~_same(np.where(gone, 0.0, np.nan), least)
            gone = gone[part]
        for column, held in every.items():
            told = held[part] & ~gone if self.keep else held[part]
            if told.any():
                self._note(column, select(block, part), told)
        self.rows += len(gone)
        start = max(0, end - kept)
        ready = select(block, part)
        self._block, self._done = select(block, slice(start, None)), end - start
        return select(ready, ~gone) if gone.any() else ready

    def _held(self, column: int, x: Array, least: int) -> Mask:
        """(n,) where a channel holds what it reads."""
        size = np.abs(np.diff(x[np.isfinite(x)]))
        step = min(self.step.get(column, np.inf), float(size[size > 0.0].min(initial=np.inf)))
        held, few = _same(x, least), least
        if np.isfinite(step):
            self.step[column] = step
            free = x[~held & np.isfinite(x)]
            if len(free) >= FREE:
                own = float(np.sqrt(max(float(white(free)) ** 2 - step**2 / 12.0, 0.0)))
                self.own[column] = max(own, self.own.get(column, 0.0))
                few = int(min(least, FEW * self.repeats))
            noise = min(self.noise[column], self.own.get(column, np.inf))
            chance = max(erf(step / (np.sqrt(8.0) * max(noise, 0.5 * step))), CHANCE)
            held = _same(x, max(few, 1 + int(np.ceil(np.log(CHANCE) / np.log(chance)))))
            held &= noise >= 0.5 * step
            held |= _drawn(x, step, noise, least)
        return held

    def _note(self, column: int, block: Block, held: Mask) -> None:
        stamps = block.stamp[held]
        self.counts[column] = self.counts.get(column, 0) + len(stamps)
        begin = self.spans.get(column, (int(stamps[0]), 0))[0]
        self.spans[column] = begin, int(stamps[-1])
        self.reading[column] = float(block.values[held, column][-1])
        last = block.values[held, column][-3:]
        if len(last) == 3 and np.all(last[1:] != last[:-1]):
            self.drawn.add(column)

    def check(self, entry: RecordingEntry) -> None:
        for column, count in self._counted():
            if count > DEAD * self.rows:
                raise RecordingError(
                    f"{self.channels[column]} reads {self.reading[column]:.6g} without any noise for "
                    f"{100.0 * count / self.rows:.0f} % of the time: it is dead, saturated or not connected",
                    where=str(entry.path),
                    remedy="take it out of the channels in the parameter files, or the recording out of campaign.toml",
                )

    def _counted(self) -> Iterator[tuple[int, int]]:
        """Columns, and readings held in them; where all that was read later shows it coarse, nothing was held."""
        for column, count in self.counts.items():
            if self.noise[column] >= 0.5 * self.step.get(column, 0.0):
                yield column, count

    def losses(self) -> Iterator[Loss]:
        for column, count in self._counted():
            begin, end = ((stamp - self.first) * 1e-9 for stamp in self.spans[column])
            detail = "one reading without noise: saturated or cut off"
            if column in self.drawn:
                detail = "readings on a smooth line without noise: drawn between others, not measured"
            elif count == self.rows:
                detail = "one reading throughout: not connected, or in steps that are greater than its noise"
            yield Loss("held", self.channels[column], count, begin, end, detail)


def _least(block: Block) -> int:
    """Rows in `HELD_S`."""
    if len(block) < 2:
        return 2
    period = float(np.median(np.diff(block.stamp))) * 1e-9
    if period == 0.0:  # stamps of packets, or none
        spans = (float(times[-1] - times[0]) for times in (block.stamp, block.log))
        period = next((span for span in spans if span > 0.0), 0.0) * 1e-9 / (len(block) - 1)
    return max(2, int(np.ceil(HELD_S / period))) if period > 0.0 else len(block)


def _same(x: Array, least: int) -> Mask:
    """(n,) where a reading is one of `least` or more in a row that are the same."""
    same = np.concatenate([[False], x[1:] == x[:-1], [False]])
    edges = np.flatnonzero(same[1:] != same[:-1]).reshape(-1, 2)
    found = np.zeros(len(x), dtype=np.bool_)
    for start, end in edges[edges[:, 1] - edges[:, 0] + 1 >= least]:
        found[start : end + 1] = True
    return found


def _drawn(x: Array, step: float, noise: float, least: int) -> Mask:
    """(n,) where `least` or more readings in a row, in steps of `step`, lie on a parabola as noise would not have them.

    Third differences take a parabola off, and rounding leaves four steps of them at most. White noise leaves no more
    in k successive ones with a probability of about erf(4 step / (sqrt(2) noise))**k: the determinant of their
    covariance grows no faster than a power of k.
    """
    found = np.zeros(len(x), dtype=np.bool_)
    chance = erf(4.0 * step / (np.sqrt(2.0) * noise)) if noise > 0.0 else 1.0
    needed = np.inf if chance >= 1.0 else np.log(CHANCE) / np.log(chance) if chance > 0.0 else 1.0
    if needed > max(least, FREE) or len(x) < 4:
        return found
    least = max(least - 3, int(np.ceil(needed)))
    smooth = np.abs(np.diff(np.where(np.isfinite(x), x, np.nan), n=3)) <= 4.0 * step
    smooth = np.concatenate([[False], smooth, [False]])
    edges = np.flatnonzero(smooth[1:] != smooth[:-1]).reshape(-1, 2)
    for start, end in edges[edges[:, 1] - edges[:, 0] >= least]:
        found[start : end + 3] = True
    return found
