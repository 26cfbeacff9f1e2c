"""One stream of a recording on its way to the working rate: ordered, timed, regridded, reduced."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from kbs_process.errors import RecordingError
from kbs_process.signals.records import (
    BLOW,
    DROPOUT,
    MISSING,
    PUT_IN_ORDER,
    ROUNDED,
    SPIKE,
    Array,
    Block,
    Loss,
    Mask,
    Stamps,
)
from kbs_process.stages.align.arrival import REGULAR, Arrival
from kbs_process.stages.align.clocks import ClockData, FloorStep, LatencyFloor
from kbs_process.stages.align.envelope import MinMax
from kbs_process.stages.align.grid import (
    AROUND,
    GAP,
    Grid,
    Regridder,
    counted,
    evened,
    longest_bridged,
    nominal_grid,
    quantum,
)
from kbs_process.stages.align.ordering import Orderer, Reblock, concatenate, finite_rows, judge
from kbs_process.stages.align.resample import Kept, Reducer, design
from kbs_process.stages.align.spectrum import Welch
from kbs_process.stages.align.spikes import Oddity, Spikes

TIMES = 10  # of single bad samples, one by one
GAPS_LISTED = 5  # one by one; more of them in one line
GAPS_KEPT = 1000
LONGEST_LATENCY = 60.0  # s, of a message; beyond it log times and stamps count from different zeros
LONG_GAP = 3  # samples
# Samples that may be made up for missing ones: so many, and so many for each that is there.
MADE_UP, MADE_UP_EACH = 1 << 20, 10
BURST = 5.0  # times the usual step: what lies between bursts
SCATTERED, PHANTOMS = 0.3, 0.005  # shares of uneven steps and of gaps, beyond which stamps are no times of samples
UNEVEN = 64  # steps that are told apart from what jitters
FAR_SLOW_NS = 3_600_000_000_000  # what is sent now and then may have one sample long before the others
# What to do about a recording that is not one.
TWO_SOURCES = "record each source under a topic of its own"
STAMP_EACH = "stamp each sample where it is taken; where a file is imported, give rate_Hz and no time column"
ONE_PART = "use one part of it: start_s and end_s of its [[recording]] in campaign.toml, or those of the import"


@dataclass(frozen=True, slots=True)
class Gap:
    """Samples that are missing between two."""

    start: float  # s on the stream's own clock, last sample before
    end: float  # first sample after
    missing: int


@dataclass(slots=True)
class Timeline:
    """Order, clock, gaps and losses of one stream, common to fast and slow ones."""

    where: str
    channels: tuple[str, ...] = ()
    grid: Grid | None = None
    by_recorder: bool = False
    gaps: list[Gap] = field(default_factory=list)
    bridged: float = 0.0  # s, the longest gap that is drawn over, as nothing in the band is so fast
    missing_bridged: int = 0  # samples in such gaps
    gap_count: int = 0
    missing_in_gaps: int = 0
    non_finite: int = 0  # samples that are NaN or infinite in some channel: all of each is left out
    samples: int = 0
    missing: int = 0
    rounded: float = 0.0  # s, to which stamps were rounded that a regular rate was found behind
    longest: float = 0.0  # s, of all gaps
    file: str = ""  # as errors call it, with the stream
    filled: bool = False  # whether gaps are filled with samples
    turning: Array = field(default_factory=lambda: np.zeros(0))  # (c,) 1 for angles, of a fast stream
    keep_spikes: bool = False
    lively: bool = True  # no reading is held by a brake or a command
    regular: bool = True  # whether most steps are like their median
    spikes: Spikes | None = None
    _non_finite_in: dict[str, int] = field(default_factory=dict)  # by channel
    _reblock: Reblock = field(default_factory=Reblock)
    _arrival: Arrival = field(default_factory=Arrival)
    _ready: Reblock = field(default_factory=Reblock)
    _orderer: Orderer | None = None
    _floor: LatencyFloor | None = None
    _open: Block | None = None  # the first one, of which the next will tell whether its stamps are rounded
    _first: int = 0
    _last: int = 0
    _uneven: list[float] = field(default_factory=list)  # s, steps that are no whole number of periods
    _scattered: int = 0  # how many these are
    _near: Stamps = field(default_factory=lambda: np.empty(0, dtype=np.int64))  # of steps that are not judged yet
    _last_gap: Gap | None = None
    _judged: int = 0  # steps between these that are

    def push(self, chunk: Block) -> list[Block]:
        """Take a chunk in file order; return ordered blocks that nothing can precede any more.

        Raises RecordingError where time goes back for good, or where more is missing than is there.
        """
        return [ready for block in self._reblock.push(chunk) for ready in self._judge(block)]

    def flush(self) -> list[Block]:
        """Return what was held back; raises RecordingError like `push`."""
        ready = [ready for block in self._reblock.flush() for ready in self._judge(block)]
        if (held := self._arrival.flush()) is not None:
            ready += self._arrived(held)
        ready += [ready for block in self._ready.flush() for ready in self._order(block)]
        last = self._orderer.flush() if self._orderer else None
        if left := [one for one in (self._open, last) if one is not None]:
            self._open = None
            ready += self._timed(concatenate(left), more=False)
        if scattered := self._arrival.scattered:
            raise RecordingError(scattered, where=self.file or self.where, remedy=STAMP_EACH)
        if self.grid is not None:
            self._find_gaps(self._near[:0], self.grid, held_back=0)
            self._check_gaps(self.grid, at_end=True)
        return ready

    def _judge(self, block: Block) -> list[Block]:
        if self._orderer is None:
            sense = judge(block)
            self.by_recorder = not sense.stamp and sense.log
            self._orderer = Orderer(sense)
        if self.by_recorder:
            block = Block(block.log, block.log, block.values)
        return self._arrived(self._arrival.push(block))

    def _arrived(self, arrived: Block) -> list[Block]:
        if self._arrival.set_back is not None:
            number, since, by = self._arrival.set_back
            raise RecordingError(
                f"time goes back by {by * 1e-9:.6g} s at sample {number + 1}, {since * 1e-9:.6g} s after the first, "
                "and goes on from there: the clock was set back, or the logger started again",
                where=self.file or self.where,
                remedy=ONE_PART,
            )
        return [ready for block in self._ready.push(arrived) for ready in self._order(block)]

    def _order(self, block: Block) -> list[Block]:
        assert self._orderer is not None
        released = self._orderer.push(block)
        if self._orderer.mixed and self.filled:
            raise RecordingError(
                "readings that differ have one stamp, by turns: two sources are in one stream",
                where=self.file or self.where,
                remedy=TWO_SOURCES,
            )
        if released is None:
            return []
        begun, self._open = self._open, None
        return self._timed(
            released if begun is None else concatenate([begun, released]), more=self._floor is None and begun is None
        )

    def _timed(self, block: Block, *, more: bool) -> list[Block]:
        """Give a block its times; the first waits for a second, if `more` stamps tell whether they are rounded."""
        stamp = evened(block, known=self.rounded > 0.0, more=more)
        if stamp is None:
            self._open = block
            return []
        if stamp is not block.stamp:
            self.rounded = max(self.rounded, quantum(block.stamp) * 1e-9)
            later = 0 if self._floor is None else max(self._last + 1 - int(stamp[0]), 0)
            own = np.array_equal(np.diff(block.log), np.diff(block.stamp))  # stamps as log times, rounded likewise
            stamp = stamp + later
            block = Block(stamp, stamp + (block.log[0] - block.stamp[0]) if own else block.log, block.values)
        if self._floor is None:
            self._floor = LatencyFloor(int(block.stamp[0]), int(block.log[0]))
            self._first = self._last = int(block.stamp[0])
        if self.grid is None and len(block) > 1:
            self.grid = nominal_grid(block.stamp)
            steps = np.diff(block.stamp)
            self._check_bursts(steps)
            self.regular = bool(np.mean(np.abs(steps / np.median(steps) - 1.0) <= 0.5) >= REGULAR)
        self._floor.push(block.stamp, block.log)
        if self.grid is not None:
            self._find_gaps(block.stamp, self.grid, held_back=AROUND)
            self._check_gaps(self.grid, at_end=False)
            periods = np.diff(block.stamp, prepend=self._last) / self.grid.period_ns
            uneven = np.abs(periods - np.maximum(np.rint(periods), 1.0)) > 0.2
            self._scattered += int(np.count_nonzero(uneven))
            if len(self._uneven) < UNEVEN:
                self._uneven += [self.own_one(int(one)) for one in block.stamp[uneven][:UNEVEN]]
        self._last = int(block.stamp[-1])
        self.samples += len(block)
        return [block]

    def _find_gaps(self, stamp: Stamps, grid: Grid, held_back: int) -> None:
        """Judge steps by the stamps around them; the last `held_back` wait for those that follow."""
        stamp = np.concatenate((self._near, stamp))
        count = counted(grid.periods(stamp))
        judged = max(len(count) - held_back, self._judged)
        for index in self._judged + np.flatnonzero(count[self._judged : judged] > 1.0):
            missing = int(count[index]) - 1
            self.missing += missing
            start, end = (self.own_one(int(one)) for one in stamp[index : index + 2])
            self.longest = max(self.longest, end - start)
            if end - start <= self.bridged:
                self.missing_bridged += missing
            else:
                self.gap_count += 1
                self.missing_in_gaps += missing
                self._last_gap = Gap(start, end, missing)
                if len(self.gaps) < GAPS_KEPT:
                    self.gaps.append(self._last_gap)
        kept = max(judged - AROUND, 0)
        self._near, self._judged = stamp[kept:].copy(), judged - kept

    def _check_bursts(self, steps: Stamps) -> None:
        """Raise RecordingError where samples come in bursts: their stamps are times of arrival."""
        usual = float(np.median(steps))
        long = steps > BURST * usual
        if self.filled and 0.01 < np.mean(long) <= 0.5 and steps[long].sum() > 0.8 * steps.sum():
            raise RecordingError(
                f"stamps come in bursts of about {1.0 / np.mean(long):.3g}, {1e-6 * usual:.3g} ms apart, every "
                f"{1e-6 * float(np.median(steps[long])):.3g} ms: they are times of arrival and not of sampling, or "
                "parts of a second in a wrong unit",
                where=self.file or self.where,
                remedy=STAMP_EACH,
            )

    def _check_gaps(self, grid: Grid, *, at_end: bool) -> None:
        """Raise RecordingError where more was made up than is worth it: work follows the samples, not their span."""
        there = self.samples * grid.period_ns * 1e-9
        scattered = self._scattered > SCATTERED * self.samples and self.gap_count > PHANTOMS * self.samples
        if at_end and self.filled and scattered:
            raise RecordingError(
                f"{self._scattered} of {self.samples} stamps are over a fifth of {1e-6 * grid.period_ns:.4g} ms off "
                "a regular rate: they are times of arrival, or samples were taken unevenly",
                where=self.file or self.where,
                remedy=STAMP_EACH,
            )
        too_many = self.missing > MADE_UP + MADE_UP_EACH * self.samples
        if self.filled and (too_many or (at_end and self.longest > there)):
            raise RecordingError(
                f"a gap of {self.longest:.6g} s, longer than all that is there: this is not one recording",
                where=self.file or self.where,
                remedy=ONE_PART,
            )

    def clean(self, block: Block) -> Iterator[tuple[Stamps, Array]]:
        """Yield stamps and values of a fast stream's samples that are numbers, their spikes interpolated."""
        if self.spikes is None and self.grid is not None:
            self.spikes = Spikes(self.turning, self.grid.period_ns * 1e-9, self.keep_spikes, self.lively)
        stamp, values = self.finite(block)
        if self.spikes is None:
            yield stamp, values
        elif len(stamp):
            yield from self.spikes.push(stamp, values)

    def end(self) -> Iterator[tuple[Stamps, Array]]:
        """Yield what `clean` held back; raises RecordingError of readings in which two sources are, or that step."""
        if self.spikes is not None:
            yield from self.spikes.flush()
        if not self.keep_spikes:
            self.check_sources()

    def check_sources(self) -> None:
        """Raise RecordingError where two sources bring a channel, or where it steps and stays there."""
        if self.spikes is not None and (mixed := self.spikes.mixed) is not None:
            raise RecordingError(
                f"{self.channels[mixed.channel]} changes to and fro by {mixed.by:.4g} from sample to sample: two "
                "sources are in one stream, unless a tone lies at just half the sampling rate",
                where=self.file or self.where,
                remedy=TWO_SOURCES,
            )
        if self.spikes is not None and (wrapped := self.spikes.wrapped) is not None:
            raise RecordingError(
                f"{self.channels[wrapped.channel]} jumps back by {abs(wrapped.by):.4g}, which is all that it spans, "
                f"{self.own_one(wrapped.first):.6g} s after the first sample and again: it begins anew there",
                where=self.file or self.where,
                remedy="export it in more bits; of an angle, give `unwrap` in the mapping of its import",
            )
        if self.spikes is not None and (noisy := self.spikes.noisy()) is not None:
            raise RecordingError(
                f"{self.channels[noisy[0]]} is off its neighbours at {noisy[1]} places in {self.samples} samples: "
                "that is no signal",
                where=self.file or self.where,
                remedy="look for a bad contact, a second source, or a driver that fills in what it has lost",
            )
        lasting: list[Oddity] = self.spikes.lasting() if self.spikes else []
        if lasting:
            one = lasting[0]
            name = self.channels[one.channel]
            more = f", one of {len(lasting)} such steps" if len(lasting) > 1 else ""
            raise RecordingError(
                f"{name} steps by {one.by:.4g} from one sample to the next, {self.own_one(one.first):.6g} s after the "
                f"first, and stays there{more}: a count was lost, a zero was set, or a load came on at once",
                where=self.file or self.where,
                remedy=ONE_PART,
            )

    def finite(self, block: Block) -> tuple[Stamps, Array]:
        """Return stamps and values of the samples that are numbers in every channel; count the others, by channel."""
        good = finite_rows(block.values)
        if good is None:
            return block.stamp, block.values
        self.non_finite += len(good) - int(np.count_nonzero(good))
        bad_in = (~np.isfinite(block.values)).sum(axis=0).tolist()
        for channel, bad in zip(self.channels, bad_in, strict=True):
            if bad:
                self._non_finite_in[channel] = self._non_finite_in.get(channel, 0) + bad
        return block.stamp[good], block.values[good]

    def stretches(self) -> Iterator[tuple[str, float, float, bool]]:
        """Yield kind, start and length, s, of what was bridged, and whether what happened may be the cause.

        What a driver fills in shows nothing that happened. Nor do rows that are missing, unless those beside them are
        shaken.
        """
        if self.spikes is None or self.grid is None:
            return
        period = 1e-9 * self.grid.period_ns
        found = [(SPIKE, one, period) for one in self.spikes.spikes] + [
            (DROPOUT, one, period) for one in self.spikes.lost
        ]
        found += [(MISSING, one, -period) for one in self.spikes.gaps]  # between samples that are there
        for kind, one, more in found:
            yield kind, self.own_one(one.first), 1e-9 * (one.last - one.first) + more, kind == DROPOUT or one.likely

    @property
    def non_finite_channels(self) -> str:
        """In which channels how many samples are NaN or infinite: "Fz in 2000, Tx in 3"."""
        return ", ".join(
            f"{name} in {self._non_finite_in[name]}" for name in self.channels if name in self._non_finite_in
        )

    def own_one(self, stamp: int) -> float:
        """Time of one stamp, s from the stream's first."""
        return (stamp - self._first) * 1e-9

    def own(self, stamp: Stamps) -> Array:
        """Times of stamps, s from the stream's first."""
        return (stamp - self._first).astype(np.float64) * 1e-9

    @property
    def first_stamp(self) -> int:
        return self._first

    @property
    def span(self) -> float:
        """From the first sample to the last, s."""
        return self.own_one(self._last)

    def floor_step(self) -> FloorStep | None:
        """A step of log - stamp that lasts: a clock was set, or a latency changed."""
        return None if self._floor is None or self.by_recorder else self._floor.step()

    def jumps(self, step: FloorStep, at: float) -> bool:
        """Whether stamps jump about `at`, s from the first log time, by what the floor steps by."""
        odd = [self.own_one(stamp) for stamp in self._arrival.doubled]
        odd += self._uneven if len(self._uneven) < UNEVEN else []
        return any(abs(one - at) <= step.within for one in odd) or any(
            abs(gap.end - gap.start - abs(step.by)) < 0.2 * abs(step.by) + self._period
            and abs(0.5 * (gap.start + gap.end) - at) <= step.within + abs(step.by)
            for gap in self.gaps
        )

    @property
    def _period(self) -> float:
        return GAP * 1e-9 * self.grid.period_ns if self.grid is not None else 0.0

    def clock(self) -> ClockData:
        """What the stream tells about its clock."""
        assert self._floor is not None
        return ClockData(self._first, self._floor.first_log, self.span, self._floor.line(), self.by_recorder)

    def losses(self, offset: float, rate: float) -> list[Loss]:
        """Everything that was wrong, on the run's time axis t = offset + rate own."""
        listed = self.gaps
        if self.gap_count > GAPS_LISTED:  # the longest by themselves, and all others in one line
            longest = sorted(self.gaps, key=lambda gap: -gap.missing)[:GAPS_LISTED]
            listed = [gap for gap in self.gaps if gap in longest and gap.missing >= LONG_GAP]
        found = [
            Loss("gap", self.where, gap.missing, offset + rate * gap.start, offset + rate * gap.end) for gap in listed
        ]
        if (more := self.gap_count - len(listed)) and self._last_gap is not None:
            start, end = (offset + rate * one for one in (self.gaps[0].start, self._last_gap.end))
            count = self.missing_in_gaps - sum(gap.missing for gap in listed)
            found.append(Loss("gap", self.where, count, start, end, f"{more} {'more ' if listed else ''}gaps"))
        if self.missing_bridged:
            detail = f"up to {1e3 * self.bridged:.2g} ms each, which is nothing in the band: bridged"
            found.append(Loss("short gap", self.where, self.missing_bridged, detail=detail))
        if self.non_finite:
            detail = f"{self.non_finite_channels}: interpolated"
            found.append(Loss("non-finite", self.where, self.non_finite, detail=detail))
        if self.by_recorder:
            detail = "the sensor's stamps do not advance: the recorder's clock is used"
            found.append(Loss("clock", self.where, self.samples, detail=detail))
        for channel, name in enumerate(self.channels):
            if own := [one for one in (self.spikes.lost if self.spikes else []) if one.channel == channel]:
                start, end = (offset + rate * self.own_one(one) for one in (own[0].first, own[-1].last))
                times = f", {len(own)} times" if len(own) > 1 else ""
                what = f"stands still at {own[0].by:.6g}, off all others{times}: left out"
                found.append(Loss(DROPOUT, f"{self.where}, {name}", sum(one.count for one in own), start, end, what))
        for kind, oddities, detail in (
            (SPIKE, self.spikes.spikes if self.spikes else [], "interpolated"),
            (BLOW, self.spikes.blows if self.spikes else [], "several channels at once: kept"),
        ):
            for channel, name in enumerate(self.channels):
                if own := [one for one in oddities if one.channel == channel]:
                    start, end = (offset + rate * self.own_one(one) for one in (own[0].first, own[-1].last))
                    by = max((one.by for one in own), key=abs)
                    times = ", ".join(f"{offset + rate * self.own_one(one.first):.4f}" for one in own[:TIMES])
                    samples = sum(one.count for one in own)
                    many = f"{samples} samples, " if samples > len(own) else ""
                    what = f"{many}off by {by:.4g}: {detail}"
                    if len(own) > 1:
                        at = f"at {times}{'' if len(own) <= TIMES else ' ...'} s"
                        what = f"{at}, {many}off by up to {by:.4g}: {detail}"
                    found.append(Loss(kind, f"{self.where}, {name}", len(own), start, end, what))
        if self.rounded and self.grid is not None:
            detail = (
                f"rounded to {1e3 * self.rounded:.3g} ms: taken as regular at {self.grid.rate:.6g} Hz, each to "
                f"{0.5e3 * self.rounded:.2g} ms"
            )
            found.append(Loss(ROUNDED, self.where, 0, detail=detail))
        if self._floor is not None and abs(apart := 1e-9 * (self._floor.first_log - self._first)) > LONGEST_LATENCY:
            far = f"{abs(apart):.4g} s" if abs(apart) < 86400.0 else f"{abs(apart) / 86400.0:.6g} days"
            ways = f"log times lie {far} {'after' if apart > 0.0 else 'before'} the stamps"
            found.append(
                Loss("clocks apart", self.where, 0, detail=f"{ways}, which no latency is: one of the two is no date")
            )
        if self._floor is not None and not self.by_recorder and (trouble := self._floor.trouble()):
            found.append(Loss("clock", self.where, 0, detail=trouble))
        if self._orderer is not None:
            found += self._disorder(self._orderer, offset, rate)
        return found

    def _disorder(self, orderer: Orderer, offset: float, rate: float) -> list[Loss]:
        found = []
        arrival = self._arrival
        if arrival.odd:
            start, end = (self.own_one(one) for one in arrival.odd_span)
            detail = "stamps that do not fit where they arrived: left out"
            found.append(Loss("odd stamp", self.where, arrival.odd, offset + rate * start, offset + rate * end, detail))
        if arrival.lone:
            detail = f"{arrival.lone_by * 1e-9:.6g} s from all others: left out"
            found.append(Loss("far stamp", self.where, arrival.lone, detail=detail))
        if orderer.repeats:
            found.append(Loss("repeat", self.where, orderer.repeats, detail="same stamp: the first is kept"))
        if orderer.late:
            detail = "too late to be put in order: dropped"
            found.append(Loss("out of order", self.where, orderer.late, detail=detail))
        placed = orderer.displaced - orderer.late
        if placed > 0:
            detail = "arrived after younger ones: nothing is lost by that"
            found.append(Loss(PUT_IN_ORDER, self.where, placed, detail=detail))
        if orderer.stray:
            detail = "stamps more than 10 s off the recorder's clock: dropped"
            found.append(Loss("clock", self.where, orderer.stray, detail=detail))
        return found


class Collected:
    """A slow stream, kept sample by sample; a `smooth` one without its spikes, as what is commanded may jump."""

    def __init__(
        self, where: str, channels: tuple[str, ...], file: str = "", *, smooth: bool = False, keep_spikes: bool = False
    ) -> None:
        self.line = Timeline(
            where, channels, file=file, keep_spikes=keep_spikes, lively=False, _arrival=Arrival(FAR_SLOW_NS)
        )
        self.line.turning = np.zeros(len(channels))
        self._smooth = smooth
        self._own: list[Array] = []
        self._values: list[Array] = []

    def push(self, chunk: Block) -> None:
        self._take(self.line.push(chunk))

    def finish(self) -> tuple[Array, Array]:
        """Return times (n,), s from the stream's first sample, and values (n, c)."""
        self._take(self.line.flush())
        if self.line.spikes is not None:
            self._keep(self.line.spikes.flush())
        if not self._own:
            return np.empty(0), np.empty((0, len(self.line.channels)))
        return np.concatenate(self._own), np.concatenate(self._values)

    def _take(self, blocks: list[Block]) -> None:
        for block in blocks:
            self._keep(self.line.clean(block) if self._smooth else [self.line.finite(block)])

    def _keep(self, pieces: Iterable[tuple[Stamps, Array]]) -> None:
        for stamp, values in pieces:
            self._own.append(self.line.own(stamp))
            self._values.append(values)


class Uniform:
    """A fast stream, reduced to a little more than twice the working rate as it passes."""

    def __init__(
        self,
        where: str,
        channels: tuple[str, ...],
        working_rate: float,
        *,
        turning: Sequence[bool] = (),
        spectrum: tuple[float, float] | None = None,
        stretches: int = 0,
        keep_below: float = 0.0,
        file: str = "",
        keep_spikes: bool = False,
        lively: bool = True,
    ) -> None:
        """`turning` channels are angles, which go on through full turns; `spectrum`: (resolution, limit), Hz; below a
        rate of `keep_below`, Hz, samples are kept as such.
        """
        self.line = Timeline(
            where,
            channels,
            bridged=longest_bridged(working_rate / 2.0),
            file=file,
            filled=True,
            keep_spikes=keep_spikes,
            lively=lively,
        )
        self.welch: Welch | None = None
        self.envelope = MinMax(len(channels), stretches) if stretches else None
        self._working_rate = working_rate
        self._spectrum = spectrum
        self._keep_below = keep_below
        self.line.turning = np.array(turning or [False] * len(channels), dtype=np.float64)
        self._turns = np.zeros(len(channels)) if any(turning) else None
        self._before: Array | None = None
        self._regrid: Regridder | None = None
        self._reduce: Reducer | None = None
        self._own: list[Array] = []
        self._values: list[Array] = []
        self._made_up: list[Stamps] = []  # rows of the grid
        self._rows = 0

    def push(self, chunk: Block) -> None:
        for block in self.line.push(chunk):
            self._take(block)

    def finish(self) -> Kept | None:
        """Return the reduced stream, or None where it is too short for the filters."""
        for block in self.line.flush():
            self._take(block)
        for piece in self.line.end():
            self._lay(*piece)
        if self._regrid is None or self._reduce is None:
            return None
        for rows, invented in self._regrid.flush():
            self._pass_on(rows, invented)
        return self._reduce.finish()

    def samples(self) -> tuple[Array, Array] | None:
        """Return times (n,) and values (n, c) of a stream slow enough to be kept."""
        return (np.concatenate(self._own), np.concatenate(self._values)) if self._own else None

    def gaps(self) -> Array:
        """Return from when to when samples are made up (k, 2), s from the first: also before and after all."""
        at = np.concatenate([np.zeros(0), *self._made_up])
        pieces = np.split(at, 1 + np.flatnonzero(np.diff(at) > 1.0))
        period = 1e-9 * self.line.grid.period_ns if self.line.grid is not None else 0.0
        made_up = [(piece[0] - 1.0, piece[-1] + 1.0) for piece in pieces if len(piece)]
        return np.array([(-np.inf, 0.0), *made_up, (self._rows - 1.0, np.inf)]) * period

    def _take(self, block: Block) -> None:
        grid = self.line.grid
        if grid is None:
            return
        if self._regrid is None:
            self._regrid = Regridder(grid, self.line.bridged)
            self._reduce = Reducer(design(grid.rate, self._working_rate))
            if self._spectrum:
                self.welch = Welch(grid.rate, *self._spectrum, self.line.channels)
        for piece in self.line.clean(block):
            self._lay(*piece)

    def _lay(self, stamp: Stamps, values: Array) -> None:
        """Lay samples on the grid, and reduce them."""
        grid = self.line.grid
        assert grid is not None and self._regrid is not None
        if self._turns is not None and len(values):
            values = self._unwrapped(values, self._turns)
        if grid.rate <= self._keep_below:
            self._own.append(self.line.own(stamp))
            self._values.append(values)
        for rows, invented in self._regrid.push(grid.periods(stamp), values):
            self._pass_on(rows, invented)

    def _pass_on(self, rows: Array, invented: Mask | None) -> None:
        assert self._reduce is not None
        self._reduce.push(rows, invented)
        if invented is not None:
            self._made_up.append(self._rows + np.flatnonzero(invented))
        self._rows += len(rows)
        if self.welch is not None:
            self.welch.push(rows, invented)
        if self.envelope is not None:
            self.envelope.push(rows)

    def _unwrapped(self, values: Array, turned: Array) -> Array:
        """Continue angles through full turns: no joint turns by half a turn between samples."""
        first = values[:1] if self._before is None else self._before
        whole = np.concatenate((first, values))
        self._before = values[-1:].copy()
        jumps = -np.rint(np.diff(whole, axis=0) / (2.0 * np.pi)) * self.line.turning
        if not jumps.any() and not turned.any():
            return values
        turns = turned + np.cumsum(jumps, axis=0)
        self._turns = turns[-1]
        unwrapped: Array = values + 2.0 * np.pi * turns
        return unwrapped
