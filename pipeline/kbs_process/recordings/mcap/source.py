"""A recording as a source of blocks: one pass over the file for all streams, a chunk at a time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import BinaryIO

import numpy as np

from kbs_process.errors import RecordingError, did_you_mean
from kbs_process.recordings.mcap import framing as mcap
from kbs_process.recordings.mcap.ahead import ahead
from kbs_process.recordings.mcap.container import AT, CHANNEL, SIZE, Container, Segment
from kbs_process.recordings.mcap.streams import SAMPLES, Reading, Sample, Stream, payloads, type_of
from kbs_process.signals.records import TRUNCATED, Block, Loss, Stamps


@dataclass(frozen=True, slots=True)
class TopicSummary:
    """A topic of a recording; `count` is None where the recorder did not write down how many messages."""

    topic: str
    type: str
    encoding: str
    count: int | None


class Counter:
    """Counts the messages of each channel."""

    def __init__(self) -> None:
        self.counts: Stamps = np.zeros(1 << 16, dtype=np.int64)

    def add(self, segment: Segment) -> None:
        """Count the messages of a segment."""
        found = np.bincount(segment.table[CHANNEL].view(np.int64))
        self.counts[: len(found)] += found

    def found(self) -> dict[int, int]:
        """Return the number of messages of each channel that has any."""
        return {int(number): int(self.counts[number]) for number in np.flatnonzero(self.counts)}


class Source:
    """A recording on disk. Times in its losses are seconds of log time since `start_ns`."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.start_ns: int | None = None  # log time of the first message
        self._readings: list[Reading] = []
        self._losses: tuple[Loss, ...] = ()
        self._topics: tuple[TopicSummary, ...] | None = None
        self._summary: mcap.Summary | None = None
        self._damage = ""  # of the summary
        try:
            with path.open("rb") as file:
                self._open(file, path.stat().st_size)
        except OSError as error:
            raise RecordingError(f"cannot be opened: {error.strerror}", where=str(path)) from error

    def _open(self, file: BinaryIO, size: int) -> None:
        if size == 0:
            raise RecordingError("the file is empty", where=str(self.path), remedy="record or copy it again")
        if file.read(len(mcap.MAGIC)) != mcap.MAGIC:
            remedy = "convert other formats with `kbs-process import`"
            raise RecordingError("this is not an MCAP file", where=str(self.path), remedy=remedy)
        try:
            self._summary = mcap.read_summary(file, size)
        except mcap.MalformedError as error:
            self._damage = str(error)
        if self._summary is not None:
            self.start_ns = self._summary.start
            if self._indexed:
                self._topics = _topics(self._summary.dictionary, self._summary.counts)

    @property
    def _indexed(self) -> bool:
        return self._summary is not None and bool(self._summary.dictionary.channels)

    @property
    def topics(self) -> tuple[TopicSummary, ...]:
        """The topics, by name. A file without an index is read through once to find them."""
        if self._topics is None:
            container, counter = self._container(), Counter()
            for segment in container.segments():
                counter.add(segment)
            self._learn(container, counter)
        return self._topics or ()

    @property
    def losses(self) -> tuple[Loss, ...]:
        """What the recording has lost; complete once `read` is exhausted."""
        return self._losses

    @property
    def publishers(self) -> dict[str, tuple[int, ...]]:
        """By stream, the channels that bring it by turns, as far as it is read."""
        return {reading.stream.key: reading.publishers for reading in self._readings if reading.publishers}

    def read(self, streams: Sequence[Stream]) -> Iterator[tuple[str, Block]]:
        """Yield (key, block) for every stream wherever it has messages, in the order of the file.

        Raises `RecordingError` for a topic, field or name that the recording does not have: before the first
        block where the file's index tells, else where the topic begins, or at the end of the file.
        """
        self._losses = ()
        container, counter = self._container(), Counter()
        if self._indexed:
            self._require_topics(streams, container.dictionary)
        readings = self._readings = [Reading(stream, container) for stream in streams]
        for segment in ahead(container.segments()):
            counter.add(segment)
            for reading in readings:
                block = reading.block(segment)
                if block is not None and len(block):
                    yield reading.stream.key, block
        self._learn(container, counter)
        self._conclude(container, counter)
        self._losses = (*container.losses, *(loss for reading in readings for loss in reading.losses()))
        self._require_topics(streams, container.dictionary)

    def samples(self) -> dict[str, Sample | str]:
        """Return a message of every topic that has any, or why its messages cannot be read."""
        found: dict[str, Sample | str] = {}
        wanted = {topic.topic for topic in self.topics if topic.count != 0}
        container = self._container()
        for segment in container.segments():
            channels = segment.dictionary.channels
            numbers, firsts = np.unique(segment.table[CHANNEL], return_index=True)
            for number, first in zip(numbers.tolist(), firsts.tolist(), strict=True):
                if number in channels and channels[number].topic not in found:
                    table = segment.table[:, first:]
                    table = table[:, table[CHANNEL] == np.uint64(number)]
                    topic = channels[number].topic
                    texts = list(islice(payloads(segment.buffer, table[AT], table[SIZE]), SAMPLES))
                    try:
                        found[topic] = Sample(type_of(segment.dictionary, number, iter(texts), topic), texts[0])
                    except RecordingError as error:
                        found[topic] = error.what
            if wanted <= found.keys():
                break
        return found

    def _container(self) -> Container:
        dictionary = mcap.Dictionary()
        if self._summary is not None:
            dictionary.schemas |= self._summary.dictionary.schemas
            dictionary.channels |= self._summary.dictionary.channels
        return Container(self.path, dictionary, self.start_ns)

    def _learn(self, container: Container, counter: Counter) -> None:
        self.start_ns = container.origin
        if self._topics is None:
            self._topics = _topics(container.dictionary, counter.found())

    def _require_topics(self, streams: Sequence[Stream], dictionary: mcap.Dictionary) -> None:
        topics = sorted({channel.topic for channel in dictionary.channels.values()})
        for stream in streams:
            if stream.topic not in topics:
                remedy = did_you_mean(stream.topic, topics)
                if topics and not remedy.startswith("known"):
                    remedy += f" (known: {', '.join(topics)})"
                raise RecordingError(f"there is no topic '{stream.topic}'", where=str(self.path), remedy=remedy)

    def _conclude(self, container: Container, counter: Counter) -> None:
        """Note what only shows at the end of a pass."""
        if self._damage:
            container.lose("undecodable", f"the summary: {self._damage}")
        elif self._summary is None and not any(loss.kind == TRUNCATED for loss in container.losses):
            with self.path.open("rb") as file:
                file.seek(max(0, container.size - len(mcap.MAGIC)))
                if file.read() != mcap.MAGIC or container.size == len(mcap.MAGIC):
                    container.lose(TRUNCATED, "the file ends without its footer")
        if container.dictionary.conflicts:
            conflicts = container.dictionary.conflicts
            container.lose("undecodable", "schemas or channels that contradict others", count=conflicts)
        found = counter.found()
        unknown = sum(count for number, count in found.items() if number not in container.dictionary.channels)
        if unknown:
            container.lose("undecodable", "messages of channels that the file does not describe", count=unknown)
        promised = self._summary.counts if self._summary is not None and self._summary.counts else {}
        for number, count in promised.items():
            if found.get(number, 0) < count and number in container.dictionary.channels:
                topic = container.dictionary.channels[number].topic
                detail = f"{topic}: {found.get(number, 0)} of {count} recorded messages found"
                container.lose("missing", detail, count=count - found.get(number, 0))


def _topics(dictionary: mcap.Dictionary, counts: dict[int, int] | None) -> tuple[TopicSummary, ...]:
    found: dict[str, TopicSummary] = {}
    for number, channel in sorted(dictionary.channels.items()):
        count = None if counts is None else counts.get(number, 0)
        before = found.get(channel.topic)
        if before is not None and before.count is not None and count is not None:
            count += before.count
        found[channel.topic] = TopicSummary(channel.topic, dictionary.schema_of(channel).name, channel.encoding, count)
    return tuple(found[topic] for topic in sorted(found))


def open_recording(path: Path) -> Source:
    """Open a recording; `RecordingError` where it is missing, empty or not MCAP."""
    return Source(path)
