"""What is in a recording: topics, rates, ranges, losses; a pass for every 4096 topics, in constant memory.

What is wrong with a stream is judged by the steps that processing goes through as well.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from kbs_process.errors import RecordingError, SchemaError
from kbs_process.recordings.mcap.source import Source, TopicSummary, open_recording
from kbs_process.recordings.mcap.streams import Sample, Stream
from kbs_process.signals.records import Block, Loss
from kbs_process.stages.align.condense import CondenseSettings, set_clock
from kbs_process.stages.align.grid import longest_bridged
from kbs_process.stages.align.stream import Timeline

TOGETHER = 4096  # topics read in one pass: each keeps some 10 kB until its end, and a file may have 65,535
# Of these readings the single samples are judged; of others the stamps alone, as steps of them may be meant.
READINGS = ("wrench.", "position[")


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
    rate_Hz: float | None
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


@dataclass(frozen=True, slots=True)
class _Plan:
    """The numbers to be read of one topic."""

    fields: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    note: str = ""
    damaged: bool = False  # its schema is, or none of its first messages can be decoded


class _Gathered:
    """What a pass learns about one topic."""

    def __init__(self, topic: str, plan: _Plan) -> None:
        columns = len(plan.fields)
        self.count = 0
        self.start: int | None = None
        self.end: int | None = None
        self.refused = plan.note if plan.damaged else ""  # why processing refuses it
        self.low = np.full(columns, np.inf)
        self.high = np.full(columns, -np.inf)
        self.not_finite = np.zeros(columns, dtype=np.int64)
        self._read = [at for at, name in enumerate(plan.fields) if name.startswith(READINGS)]
        names = tuple(plan.fields[at] for at in self._read)
        angles = np.array([name.startswith("position") for name in names], dtype=np.float64)
        self.line = Timeline(
            topic,
            names,
            bridged=longest_bridged(0.5 * CondenseSettings().working_rate_Hz),
            file=topic,
            filled=bool(names),
            turning=angles,
        )

    def add(self, block: Block) -> None:
        if not self.count:  # what begins without a reading is not judged, or nothing else would be
            self._silent = np.logical_and.reduce(np.isnan(block.values), axis=0)
        first, last = int(block.stamp.min()), int(block.stamp.max())
        self.start = first if self.start is None else min(self.start, first)
        self.end = last if self.end is None else max(self.end, last)
        self.count += len(block)
        self._judge(Block(block.stamp, block.log, np.where(self._silent, 0.0, block.values)[:, self._read]))
        if block.values.shape[1]:
            finite = np.isfinite(block.values)
            self.not_finite += len(block) - finite.sum(axis=0)
            self.low = np.minimum(self.low, np.where(finite, block.values, np.inf).min(axis=0))
            self.high = np.maximum(self.high, np.where(finite, block.values, -np.inf).max(axis=0))

    def _judge(self, block: Block | None) -> None:
        """Take the next block, or end with None."""
        try:
            if not self.refused:
                for ready in self.line.flush() if block is None else self.line.push(block):
                    if self._read:
                        deque(self.line.clean(ready), maxlen=0)
                if block is None and self._read:
                    deque(self.line.end(), maxlen=0)
        except RecordingError as error:
            self.refused = error.what

    def finish(self) -> Timeline | None:
        """Take what was held back; return the timeline of readings whose clock can be judged."""
        self._judge(None)
        return self.line if self._read and self.line.samples and not self.refused else None

    def losses(self, origin: int | None) -> Iterator[Loss]:
        """Yield what is wrong with the stream, in s from `origin` of the recorder's clock."""
        if self.refused:
            yield Loss("unusable", self.line.where, self.count, detail=self.refused)
        if self.line.samples:
            start = (self.line.clock().first_log - (origin or 0)) * 1e-9
            for loss in self.line.losses(start, 1.0):
                # What is sent now and then has no gaps; numbers that are none are told by the reader.
                if loss.kind != "non-finite" and (self.line.regular or loss.kind not in ("gap", "short gap")):
                    yield loss

    def ranges(self, fields: Iterable[str]) -> tuple[FieldRange, ...]:
        low = np.where(self.low <= self.high, self.low, np.nan)
        high = np.where(self.low <= self.high, self.high, np.nan)
        return tuple(map(FieldRange, fields, low.tolist(), high.tolist(), self.not_finite.tolist()))


def inspect_recording(path: Path) -> Inspection:
    """Read a whole recording and say what is in it; never raises for what is wrong with the file."""
    found, losses = list[TopicInspection](), list[Loss]()
    try:
        source = open_recording(path)
        topics = source.topics
        samples = source.samples()
        for first in range(0, max(len(topics), 1), TOGETHER):
            part = topics[first : first + TOGETHER]
            plans = {topic.topic: _plan(samples.pop(topic.topic, None)) for topic in part}
            gathered = _gathered(source, plans)
            # Every pass meets what is wrong with the file itself.
            known = set(losses)
            losses += [loss for loss in source.losses if loss not in known]
            losses += _by_turns(source)
            for one in gathered.values():
                losses += one.losses(source.start_ns)
            found += [_conclude(topic, plans[topic.topic], gathered[topic.topic]) for topic in part]
    except RecordingError as error:
        return Inspection(path, "unreadable", (), (), str(error))
    if source.losses and not any(topic.count for topic in found):
        return Inspection(path, "unreadable", tuple(found), tuple(losses), "no message could be read")
    state: Literal["clean", "lossy"] = "lossy" if any(loss.real for loss in losses) else "clean"
    return Inspection(path, state, tuple(found), tuple(losses))


def _gathered(source: Source, plans: Mapping[str, _Plan]) -> dict[str, _Gathered]:
    """Read some of the topics through."""
    gathered = {topic: _Gathered(topic, plan) for topic, plan in plans.items()}
    streams = [Stream(topic, topic, plan.fields, lenient=True) for topic, plan in plans.items()]
    for topic, block in source.read(streams):
        gathered[topic].add(block)
    lines = {topic: one.finish() for topic, one in gathered.items()}
    if (found_set := set_clock({topic: line for topic, line in lines.items() if line is not None})) is not None:
        gathered[found_set[0]].refused = found_set[1]
    return gathered


def _by_turns(source: Source) -> Iterator[Loss]:
    for topic, channels in source.publishers.items():
        detail = f"channels {', '.join(map(str, channels))} bring it by turns"
        yield Loss("publishers", topic, len(channels), detail=detail)


def _plan(sample: Sample | RecordingError | None) -> _Plan:
    """Plan for every number of a topic, and the elements of its sequences that one message has."""
    if sample is None:
        return _Plan(note="no messages")
    if isinstance(sample, RecordingError):
        return _Plan(note=sample.what, damaged=isinstance(sample, SchemaError))
    if fault := sample.fault():
        return _Plan(note=fault, damaged=True)
    return _Plan(tuple(sample.numbers()), sample.names())


def _conclude(topic: TopicSummary, plan: _Plan, gathered: _Gathered) -> TopicInspection:
    return TopicInspection(
        topic.topic,
        topic.type,
        topic.encoding,
        gathered.count,
        gathered.start,
        gathered.end,
        gathered.line.grid.rate if gathered.line.grid is not None else None,
        gathered.ranges(plan.fields) if gathered.count else (),
        plan.names,
        plan.note,
    )
