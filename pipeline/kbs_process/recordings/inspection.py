"""What is in a recording: topics, rates, gaps, ranges, losses; one pass, in constant memory."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Literal

import numpy as np

from kbs_process.errors import RecordingError
from kbs_process.recordings.mcap.messages.fields import STAMPS
from kbs_process.recordings.mcap.source import TopicSummary, open_recording
from kbs_process.recordings.mcap.streams import Sample, Stream
from kbs_process.signals.records import Block, Loss, Stamps

LONGEST_ARRAY = 64  # elements of a sequence whose ranges are given
GAP = 1.5  # of the median interval
BINS_PER_OCTAVE = 64  # of the intervals' histogram: the gap's limit is exact to 1.1 %


@dataclass(frozen=True, slots=True)
class FieldRange:
    """Least and greatest finite value of a field, NaN where there is none, and how many are not finite."""

    field: str
    low: float
    high: float
    not_finite: int


@dataclass(frozen=True, slots=True)
class TopicInspection:
    """One topic. Times are those of the sensor's clock where messages carry it, else of the recorder's."""

    topic: str
    type: str
    encoding: str
    count: int
    start_ns: int | None
    end_ns: int | None
    rate_Hz: float | None  # of the mean interval that is no gap
    gaps: int  # intervals above 1.5 medians
    longest_interval_s: float
    repeats: int  # messages with the stamp of the one before
    out_of_order: int  # messages older than the one before
    ranges: tuple[FieldRange, ...]
    names: tuple[str, ...]  # of joints
    note: str = ""  # why the numbers could not be read


@dataclass(frozen=True, slots=True)
class Inspection:
    """A recording: every topic, and what is lost."""

    path: Path
    state: Literal["clean", "lossy", "unreadable"]
    topics: tuple[TopicInspection, ...]
    losses: tuple[Loss, ...]
    reason: str = ""  # why it is unreadable


@dataclass(slots=True, eq=False)
class Intervals:
    """Intervals between successive stamps: a histogram with logarithmic bins, exact counts of what is amiss."""

    bins: dict[int, tuple[int, float]] = field(default_factory=dict)  # -> how many, and their sum, ns
    last: int | None = None
    repeats: int = 0
    out_of_order: int = 0
    longest: int = 0  # ns

    def add(self, stamp: Stamps) -> None:
        """Add the stamps that follow those added before."""
        steps = np.diff(stamp, prepend=stamp[0] if self.last is None else self.last)
        steps = steps[1:] if self.last is None else steps
        self.last = int(stamp[-1])
        self.repeats += int((steps == 0).sum())
        self.out_of_order += int((steps < 0).sum())
        steps = steps[steps > 0]
        if len(steps):
            self.longest = max(self.longest, int(steps.max()))
            bins, places, counts = np.unique(
                (np.log2(steps) * BINS_PER_OCTAVE).astype(np.int64), return_inverse=True, return_counts=True
            )
            sums = np.bincount(places, weights=steps.astype(np.float64))
            for place, count, total in zip(bins.tolist(), counts.tolist(), sums.tolist(), strict=True):
                before, sum_before = self.bins.get(place, (0, 0.0))
                self.bins[place] = before + count, sum_before + total

    def median(self) -> float | None:
        """Return the median interval, ns: the mean of the bin that it lies in."""
        left = (sum(count for count, _ in self.bins.values()) + 1) // 2
        for place in sorted(self.bins):
            count, total = self.bins[place]
            left -= count
            if left <= 0:
                return total / count
        return None

    def usual(self) -> float | None:
        """Return the mean of intervals of half to one and a half medians, ns: no gaps, and jitter is averaged."""
        median = self.median()
        if median is None:
            return None
        low, high = (int(np.log2(share * median) * BINS_PER_OCTAVE) for share in (2.0 - GAP, GAP))
        inside = [entry for place, entry in self.bins.items() if low <= place <= high]
        return sum(total for _, total in inside) / sum(count for count, _ in inside)

    def gaps(self) -> int:
        """Return how many intervals exceed `GAP` medians."""
        median = self.median()
        if median is None:
            return 0
        limit = int(np.log2(GAP * median) * BINS_PER_OCTAVE)
        return sum(count for place, (count, _) in self.bins.items() if place > limit)


class _Gathered:
    """What a pass learns about one topic."""

    def __init__(self, columns: int) -> None:
        self.count = 0
        self.start: int | None = None
        self.end: int | None = None
        self.intervals = Intervals()
        self.low = np.full(columns, np.inf)
        self.high = np.full(columns, -np.inf)
        self.not_finite = np.zeros(columns, dtype=np.int64)

    def add(self, block: Block) -> None:
        first, last = int(block.stamp.min()), int(block.stamp.max())
        self.start = first if self.start is None else min(self.start, first)
        self.end = last if self.end is None else max(self.end, last)
        self.count += len(block)
        self.intervals.add(block.stamp)
        if block.values.shape[1]:
            finite = np.isfinite(block.values)
            self.not_finite += len(block) - finite.sum(axis=0)
            self.low = np.minimum(self.low, np.where(finite, block.values, np.inf).min(axis=0))
            self.high = np.maximum(self.high, np.where(finite, block.values, -np.inf).max(axis=0))

    def ranges(self, fields: Iterable[str]) -> tuple[FieldRange, ...]:
        low = np.where(self.low <= self.high, self.low, np.nan)
        high = np.where(self.low <= self.high, self.high, np.nan)
        return tuple(map(FieldRange, fields, low.tolist(), high.tolist(), self.not_finite.tolist()))


@dataclass(frozen=True, slots=True)
class _Plan:
    """The numbers to be read of one topic."""

    fields: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    note: str = ""


def inspect_recording(path: Path) -> Inspection:
    """Read a whole recording and say what is in it; never raises for what is wrong with the file."""
    try:
        source = open_recording(path)
        topics = source.topics
        samples = source.samples()
        plans = {topic.topic: _plan(samples.get(topic.topic)) for topic in topics}
        gathered = {topic: _Gathered(len(plan.fields)) for topic, plan in plans.items()}
        for topic, block in source.read([Stream(topic, topic, plan.fields) for topic, plan in plans.items()]):
            gathered[topic].add(block)
    except RecordingError as error:
        return Inspection(path, "unreadable", (), (), str(error))
    found = tuple(_conclude(topic, plans[topic.topic], gathered[topic.topic]) for topic in topics)
    if source.losses and not any(topic.count for topic in found):
        return Inspection(path, "unreadable", found, source.losses, "no message could be read")
    return Inspection(path, "lossy" if source.losses else "clean", found, source.losses)


def _plan(sample: Sample | str | None) -> _Plan:
    """Plan for every number of a topic, and the elements of its sequences that one message has."""
    if sample is None or isinstance(sample, str):
        return _Plan(note=sample or "no messages")
    fields: list[str] = []
    names: tuple[str, ...] = ()
    for entry in sample.type.fields:
        if entry.path.startswith(STAMPS):
            continue
        if entry.count is None:
            fields.append(entry.path)
            continue
        elements = sample.elements(entry.path)
        named = entry.named and len(elements.names) >= elements.count
        keys = elements.names if named else map(str, range(elements.count))
        if elements.count <= LONGEST_ARRAY:
            fields += [f"{entry.path}[{key}]" for key in islice(keys, elements.count)]
        names = elements.names if entry.named else names
    return _Plan(tuple(fields), names)


def _conclude(topic: TopicSummary, plan: _Plan, gathered: _Gathered) -> TopicInspection:
    intervals = gathered.intervals
    usual = intervals.usual()
    return TopicInspection(
        topic.topic,
        topic.type,
        topic.encoding,
        gathered.count,
        gathered.start,
        gathered.end,
        None if usual is None else 1e9 / usual,
        intervals.gaps(),
        intervals.longest / 1e9,
        intervals.repeats,
        intervals.out_of_order,
        gathered.ranges(plan.fields),
        plan.names,
        plan.note,
    )
