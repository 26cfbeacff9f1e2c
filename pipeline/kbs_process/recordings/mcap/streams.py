"""One stream during a pass over a file: its decoders, its blocks, and what it has lost."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice

import numpy as np

from kbs_process.errors import RecordingError, did_you_mean
from kbs_process.recordings.mcap.container import Container, Segment
from kbs_process.recordings.mcap.framing import Dictionary
from kbs_process.recordings.mcap.kernels import Bytes, Words, select
from kbs_process.recordings.mcap.messages.decoders import Decoder, MessageType, message_type
from kbs_process.recordings.mcap.messages.fields import Step, resolve
from kbs_process.signals.records import Block, Loss, Stamps

CHOOSE = "several publishers bring the topic: choose one by its `channel` in campaign.toml"
RETURNS = 2  # to a channel that was left for another of the same topic: there are two publishers
SAMPLES = 64  # messages from which the numbers of a type without schema are learnt


@dataclass(frozen=True, slots=True)
class Stream:
    """Numbers wanted from one topic; `fields` are paths such as "wrench.force.x" or "position[az]"."""

    key: str
    topic: str
    fields: tuple[str, ...]
    otherwise: str = ""  # what to do where no message has one of the elements that fields name
    channel: int | None = None  # number of the one channel of the topic that is wanted; None: all
    lenient: bool = False  # a message without an element that fields name is a loss, and never an error


@dataclass(slots=True, eq=False)
class Tally:
    """What was lost of one stream, with the log times of the first and last message concerned."""

    counts: dict[str, int] = field(default_factory=dict)
    spans: dict[str, tuple[int, int]] = field(default_factory=dict)

    def add(self, kind: str, log: Stamps) -> None:
        """Add the messages with these log times."""
        if len(log):
            low, high = int(log.min()), int(log.max())
            first, last = self.spans.get(kind, (low, high))
            self.spans[kind] = (min(first, low), max(last, high))
            self.counts[kind] = self.counts.get(kind, 0) + len(log)


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """The type of a topic's messages, and one of them."""

    type: MessageType
    payload: bytes


@dataclass(frozen=True, slots=True, eq=False)
class _Plan:
    """How the messages of one channel are decoded for the stream."""

    type: MessageType
    steps: tuple[Step, ...]
    decode: Decoder


@dataclass(slots=True)
class _Turns:
    """Which channels brought a topic, one after the other."""

    seen: set[int] = field(default_factory=set)
    last: int | None = None
    returns: int = 0  # to a channel that had been left

    def add(self, numbers: Sequence[int]) -> None:
        for number in numbers:
            if number != self.last:
                self.returns += number in self.seen
                self.seen.add(number)
                self.last = number


def _twice(blocks: Sequence[Block]) -> bool:
    """Whether several channels bring the same messages, but for those that a chunk's edge parts."""
    first, *others = blocks
    for one in others:
        common, mine, theirs = np.intersect1d(first.stamp, one.stamp, return_indices=True)
        same = np.array_equal(first.values[mine], one.values[theirs], equal_nan=True)
        if not same or 2 * len(common) < min(len(first), len(one)):
            return False
    return True


class Reading:
    """The state of one stream during a pass."""

    def __init__(self, stream: Stream, container: Container) -> None:
        self.stream = stream
        self._container = container
        self._plans: dict[int, _Plan] = {}
        self._tally = Tally()
        self._where = f"{container.path.name}, {stream.topic}"
        self._turns = _Turns()

    def block(self, segment: Segment) -> Block | None:
        """Return the stream's messages in the segment, in their order; None where there is none."""
        dictionary = segment.dictionary
        parts = []
        numbers = []
        for number in [n for n, channel in dictionary.channels.items() if channel.topic == self.stream.topic]:
            if self.stream.channel not in (None, number):
                continue
            places, log, at, size = select(segment.table, np.uint64(number))
            if len(places):
                parts.append(self._decode(number, segment, places, log, at, size))
                numbers.append(number)
        if len(parts) < 2:
            self._turns.add(numbers)
            return parts[0][1] if parts else None
        order = np.argsort(np.concatenate([places for places, _ in parts]))
        blocks = [block for _, block in parts]
        lengths = [len(block) for block in blocks]
        if not _twice(blocks):
            came = np.repeat(numbers, lengths)[order]
            self._turns.add(came[np.flatnonzero(np.diff(came, prepend=-1))].tolist())
        return Block(
            np.concatenate([block.stamp for block in blocks])[order],
            np.concatenate([block.log for block in blocks])[order],
            np.concatenate([block.values for block in blocks])[order],
        )

    @property
    def publishers(self) -> tuple[int, ...]:
        """The channels that bring the topic by turns; none where each ends before the next begins."""
        return tuple(sorted(self._turns.seen)) if self._turns.returns >= RETURNS else ()

    def losses(self) -> Iterator[Loss]:
        """Yield what the stream has lost."""
        seconds = self._container.seconds
        for kind, count in self._tally.counts.items():
            first, last = self._tally.spans[kind]
            yield Loss(kind, self._where, count, seconds(first), seconds(last))

    def _decode(
        self, number: int, segment: Segment, places: Stamps, log: Stamps, at: Words, size: Words
    ) -> tuple[Stamps, Block]:
        if not self.stream.fields:  # messages of any type can be counted
            return places, Block(log, log, np.empty((len(log), 0)))
        fresh = number not in self._plans
        if fresh:
            self._plans[number] = self._plan(number, segment.dictionary, payloads(segment.buffer, at, size))
        plan = self._plans[number]
        decoded = plan.decode(segment.buffer, at, size, log)
        good = decoded.good
        if fresh and good.any() and not self.stream.lenient:
            payload = next(payloads(segment.buffer, at[good], size[good]))
            several = sum(one.topic == self.stream.topic for one in segment.dictionary.channels.values()) > 1
            otherwise = CHOOSE if several else self.stream.otherwise
            _require_names(plan, decoded.present.tolist(), payload, self._where, otherwise)
        if decoded.flawless:
            return places, Block(decoded.stamp, log, decoded.values)
        self._tally.add("missing field", log[decoded.lacking])
        values, stamp, lacking = decoded.values, decoded.stamp, decoded.lacking
        if not good.all():
            self._tally.add("undecodable", log[~good])
            places, log, lacking = places[good], log[good], lacking[good]
            stamp, values = stamp[good], values[good]
        bad = ~np.isfinite(values).all(axis=1)
        self._tally.add("non-finite", log[bad & ~lacking])
        return places, Block(stamp, log, values)

    def _plan(self, number: int, dictionary: Dictionary, samples: Iterator[bytes]) -> _Plan:
        kind = type_of(dictionary, number, samples, self._where)
        name = dictionary.schema_of(dictionary.channels[number]).name
        steps = resolve(self.stream.fields, kind.fields, f"{self._where} ({name})" if name else self._where)
        return _Plan(kind, steps, kind.decoder(steps))


def type_of(dictionary: Dictionary, number: int, samples: Iterator[bytes], where: str) -> MessageType:
    """Return the type of a channel's messages."""
    channel = dictionary.channels[number]
    return message_type(channel, dictionary.schema_of(channel), islice(samples, SAMPLES), where)


def payloads(buffer: Bytes, at: Words, size: Words) -> Iterator[bytes]:
    """Yield the payloads of messages."""
    for first, length in zip(at.tolist(), size.tolist(), strict=True):
        yield buffer[first : first + length].tobytes()


def _require_names(plan: _Plan, present: Sequence[bool], payload: bytes, where: str, otherwise: str) -> None:
    """Raise an error for a name that no message has; a merely empty array is a loss, not an error."""
    for step, there in zip(plan.steps, present, strict=True):
        if not there and isinstance(step.key, str):
            names = plan.type.elements(payload, step.path).names
            if step.key not in names:
                remedy = did_you_mean(step.key, names)
                raise RecordingError(
                    f"no message names an element '{step.key}' of {step.path}",
                    where=where,
                    remedy=f"{remedy}; {otherwise}" if otherwise else remedy,
                )
