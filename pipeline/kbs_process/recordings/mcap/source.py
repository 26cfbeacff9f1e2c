"""A recording as a source of blocks: one pass over the file for all streams, a chunk at a time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from kbs_process.errors import RecordingError, did_you_mean
from kbs_process.files import regular
from kbs_process.recordings.mcap import framing as mcap
from kbs_process.recordings.mcap.ahead import ahead
from kbs_process.recordings.mcap.container import AT, SIZE, Container, Described
from kbs_process.recordings.mcap.streams import SAMPLES, Reading, Sample, Stream, payloads, type_of
from kbs_process.signals.records import TRUNCATED, Block, Loss


@dataclass(frozen=True, slots=True)
class TopicSummary:
    """A topic of a recording; `count` is None where the recorder did not write down how many messages."""

    topic: str
    type: str
    encoding: str
    count: int | None


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
            with regular(path).open("rb") as file:
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
            container, counts = self._container(), Counter[int]()
            for segment in container.segments():
                counts.update(segment.counts)
            self._learn(container, counts)
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
        container, counts = self._container(), Counter[int]()
        if self._indexed:
            self._require_topics(streams, container.dictionary)
        readings = self._readings = [Reading(stream, container) for stream in streams]
        wanting: dict[str, list[int]] = {}
        for place, stream in enumerate(streams):
            wanting.setdefault(stream.topic, []).append(place)
        for segment in ahead(container.segments()):
            counts.update(segment.counts)
            channels: dict[str, list[Described]] = {}
            for channel in segment.channels:
                channels.setdefault(channel.topic, []).append(channel)
            found = sorted((place, topic) for topic in channels for place in wanting.get(topic, ()))
            for place, topic in found:
                block = readings[place].block(segment, channels[topic])
                if block is not None and len(block):
                    yield streams[place].key, block
        self._learn(container, counts)
        self._conclude(container, counts)
        self._losses = (*container.losses, *(loss for reading in readings for loss in reading.losses()))
        self._require_topics(streams, container.dictionary)

    def samples(self) -> dict[str, Sample | RecordingError]:
        """Return a message of every topic that has any, or why its messages cannot be read."""
        found: dict[str, Sample | RecordingError] = {}
        tried = Counter[str]()
        wanted = {topic.topic for topic in self.topics if topic.count != 0}
        for segment in self._container().segments():
            for channel in segment.channels:
                if channel.topic in wanted:
                    places = segment.places(channel.number)[:SAMPLES]
                    rows = segment.table[AT, places], segment.table[SIZE, places]
                    for sample in _samples(channel, payloads(segment.buffer, *rows), payloads(segment.buffer, *rows)):
                        tells = isinstance(sample, RecordingError) or sample.tells()
                        before = found.get(channel.topic)
                        if tells or before is None or (isinstance(before, Sample) and before.fault()):
                            found[channel.topic] = sample
                        tried[channel.topic] += 1
                        if tells or tried[channel.topic] >= SAMPLES:
                            wanted.discard(channel.topic)
                            break
            if not wanted:
                break
        return found

    def _container(self) -> Container:
        dictionary = mcap.Dictionary()
        if self._summary is not None:
            dictionary.schemas |= self._summary.dictionary.schemas
            dictionary.channels |= self._summary.dictionary.channels
        return Container(self.path, dictionary, self.start_ns)

    def _learn(self, container: Container, counts: Counter[int]) -> None:
        self.start_ns = container.origin
        if self._topics is None:
            self._topics = _topics(container.dictionary, counts)

    def _require_topics(self, streams: Sequence[Stream], dictionary: mcap.Dictionary) -> None:
        known = {channel.topic for channel in dictionary.channels.values()}
        for stream in streams:
            if stream.topic not in known:
                topics = sorted(known)
                remedy = did_you_mean(stream.topic, topics)
                if topics and not remedy.startswith("known"):
                    remedy += f" (known: {', '.join(topics)})"
                raise RecordingError(f"there is no topic '{stream.topic}'", where=str(self.path), remedy=remedy)

    def _conclude(self, container: Container, found: Counter[int]) -> None:
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
        unknown = sum(count for number, count in found.items() if number not in container.dictionary.channels)
        if unknown:
            container.lose("undecodable", "messages of channels that the file does not describe", count=unknown)
        promised = self._summary.counts if self._summary is not None and self._summary.counts else {}
        for number, count in promised.items():
            if found.get(number, 0) < count and number in container.dictionary.channels:
                topic = container.dictionary.channels[number].topic
                detail = f"{topic}: {found.get(number, 0)} of {count} recorded messages found"
                container.lose("missing", detail, count=count - found.get(number, 0))


def _samples(channel: Described, first: Iterator[bytes], texts: Iterator[bytes]) -> Iterator[Sample | RecordingError]:
    """Yield messages of a channel, whose type the `first` of them may tell, or why they cannot be read."""
    try:
        kind = type_of(channel, first, channel.topic)
    except RecordingError as error:
        yield error
        return
    for text in texts:
        yield Sample(kind, text)


def _topics(dictionary: mcap.Dictionary, counts: Mapping[int, int] | None) -> tuple[TopicSummary, ...]:
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
