"""One stream during a pass over a file: its decoders, its blocks, and what it has lost."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice

import numpy as np

from kbs_process.errors import RecordingError, did_you_mean
from kbs_process.recordings.mcap.container import AT, LOG, SIZE, Container, Described, Segment
from kbs_process.recordings.mcap.framing import MalformedError
from kbs_process.recordings.mcap.kernels import NO_STAMP, Bytes, Words
from kbs_process.recordings.mcap.messages.decoders import Decoder, MessageType, message_type
from kbs_process.recordings.mcap.messages.fields import STAMPS, Elements, Step, resolve
from kbs_process.signals.records import Array, Block, Loss, Mask, Stamps

CHOOSE = "several publishers bring the topic: choose one by its `channel` in campaign.toml"
RETURNS = 2  # to a channel that was left for another of the same topic: there are two publishers
LONGEST_ARRAY = 64  # elements of a sequence that are told one by one
SAMPLES = 64  # messages from which the numbers of a type without schema are learnt
_NO_STAMP = "seconds beyond 2^33, or nanoseconds outside 0 to 999999999: mend the driver, or leave its stamp out"


@dataclass(frozen=True, slots=True)
class Stream:
    """Numbers wanted from one topic; `fields` are paths such as "wrench.force.x" or "position[az]"."""

    key: str
    topic: str
    fields: tuple[str, ...]
    otherwise: str = ""  # what to do where no message has one of the elements that fields name
    channel: int | None = None  # number of the one channel of the topic that is wanted; None: all
    lenient: bool = False  # a message without an element that fields name is a loss, never an error; see `_never`


@dataclass(slots=True, eq=False)
class Tally:
    """What was lost of one stream, with the log times of the first and last message concerned."""

    counts: dict[str, int] = field(default_factory=dict)
    spans: dict[str, tuple[int, int]] = field(default_factory=dict)
    details: dict[str, str] = field(default_factory=dict)  # of the first

    def add(self, kind: str, log: Stamps, detail: str = "") -> None:
        """Add the messages with these log times."""
        if len(log):
            low, high = int(log.min()), int(log.max())
            first, last = self.spans.get(kind, (low, high))
            self.spans[kind] = (min(first, low), max(last, high))
            self.counts[kind] = self.counts.get(kind, 0) + len(log)
            self.details.setdefault(kind, detail)


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """The type of a topic's messages, and one of them."""

    type: MessageType
    payload: bytes

    def elements(self, path: str) -> Elements:
        """Return the names and the length of a sequence in the message; none where it cannot be decoded."""
        try:
            return self.type.elements(self.payload, path)
        except MalformedError:
            return Elements((), 0)

    def tells(self) -> bool:
        """Whether the message shows how long sequences are: a first one may hold nothing yet."""
        sequences = self._sequences()
        return not sequences or any(self.elements(path).count for path in sequences)

    def fault(self) -> str:
        """Say why the message's sequences cannot be decoded, "" where they can."""
        try:
            for path in self._sequences():
                self.type.elements(self.payload, path)
        except MalformedError as error:
            return str(error)
        return ""

    def numbers(self) -> list[str]:
        """Return the paths of its numbers but its stamp, elements of sequences as this message has them."""
        found: list[str] = []
        for entry in self.type.fields:
            if entry.path.startswith(STAMPS):
                continue
            if entry.count is None:
                found.append(entry.path)
                continue
            elements = self.elements(entry.path)
            named = entry.named and len(elements.names) >= elements.count
            keys = elements.names if named else map(str, range(elements.count))
            if elements.count <= LONGEST_ARRAY:
                found += [f"{entry.path}[{key}]" for key in islice(keys, elements.count)]
        return found

    def names(self) -> tuple[str, ...]:
        """Return the names of the elements of its last named sequence."""
        named = [entry.path for entry in self.type.fields if entry.named and entry.count is not None]
        return self.elements(named[-1]).names if named else ()

    def _sequences(self) -> list[str]:
        return [field.path for field in self.type.fields if field.count is not None]


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
        self._tally, self._read = Tally(), Tally()  # what is lost, and of messages all that came
        self._heard = np.full(len(stream.fields), not stream.lenient)  # fields that had a reading, or must have
        self._where = f"{container.path.name}, {stream.topic}"
        self._turns = _Turns()
        self._publishers: set[bytes] = set()  # by what a recorder writes of them

    def block(self, segment: Segment, channels: Sequence[Described]) -> Block | None:
        """Return the stream's messages in the segment, in their order; `channels` are those of its topic there."""
        channels = [one for one in channels if self.stream.channel in (None, one.number)]
        self._publishers.update(one.metadata for one in channels)
        numbers = [channel.number for channel in channels]
        parts = [self._decode(channel, segment) for channel in channels]
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
        """The channels that bring the topic by turns; none where each is the same publisher's who began again."""
        several = self._turns.returns >= RETURNS or (len(self._publishers) > 1 and len(self._turns.seen) > 1)
        return tuple(sorted(self._turns.seen)) if several else ()

    def losses(self) -> Iterator[Loss]:
        """Yield what the stream has lost."""
        seconds = self._container.seconds
        for kind, count in self._tally.counts.items():
            first, last = self._tally.spans[kind]
            yield Loss(kind, self._where, count, seconds(first), seconds(last), self._tally.details.get(kind, ""))

    def _decode(self, channel: Described, segment: Segment) -> tuple[Stamps, Block]:
        places = segment.places(channel.number)
        at, size = segment.table[AT, places], segment.table[SIZE, places]
        log = segment.table[LOG, places].view(np.int64)
        if not self.stream.fields:  # messages of any type can be counted
            return places, Block(log, log, np.empty((len(log), 0)))
        fresh = channel.number not in self._plans
        if fresh:
            self._plans[channel.number] = self._plan(channel, payloads(segment.buffer, at, size))
        plan = self._plans[channel.number]
        decoded = plan.decode(segment.buffer, at, size, log)
        values, stamp, lacking, good = decoded.values, decoded.stamp, decoded.lacking, decoded.good
        if fresh and good.any() and not self.stream.lenient:
            payload = next(payloads(segment.buffer, at[good], size[good]))
            known = self._container.dictionary.channels.values()
            several = sum(one.topic == self.stream.topic for one in known) > 1
            otherwise = CHOOSE if several else self.stream.otherwise
            _require_names(plan, decoded.present.tolist(), payload, self._where, otherwise)
        stamped = stamp != NO_STAMP
        if decoded.flawless and stamped.all() and not self.stream.lenient:
            return places, Block(stamp, log, values)
        self._tally.add("missing field", log[lacking])
        self._tally.add("undecodable", log[~good], decoded.reason)
        self._tally.add("no valid stamp", log[good & ~stamped], _NO_STAMP)
        kept = good & stamped
        read = kept & ~lacking
        bad: Mask = ~np.logical_and.reduce(np.isfinite(values[read]) | self._never(values[read], log[read]), axis=1)
        self._tally.add("non-finite", log[read][bad])
        return places[kept], Block(stamp[kept], log[kept], values[kept])

    def _never(self, values: Array, log: Stamps) -> Mask:
        """Which fields of a listing have had no reading so far, if others have: they lack nothing."""
        heard = self._heard | ~np.isnan(values).all(axis=0)
        if (heard & ~self._heard).any() and self._read.counts:  # it was missing in all that came before
            self._tally.counts |= self._read.counts
            self._tally.spans |= self._read.spans
        self._heard = heard
        self._read.add("non-finite", log)
        return ~heard & heard.any()

    def _plan(self, channel: Described, samples: Iterator[bytes]) -> _Plan:
        kind = type_of(channel, samples, self._where)
        name = channel.schema.name
        steps = resolve(self.stream.fields, kind.fields, f"{self._where} ({name})" if name else self._where)
        return _Plan(kind, steps, kind.decoder(steps))


def type_of(channel: Described, samples: Iterator[bytes], where: str) -> MessageType:
    """Return the type of a channel's messages."""
    return message_type(channel.encoding, channel.schema, islice(samples, SAMPLES), where)


def payloads(buffer: Bytes, at: Words, size: Words) -> Iterator[bytes]:
    """Yield the payloads of messages."""
    for first, length in zip(at.tolist(), size.tolist(), strict=True):
        yield buffer[first : first + length].tobytes()


def _require_names(plan: _Plan, present: Sequence[bool], payload: bytes, where: str, otherwise: str) -> None:
    """Raise an error for a name that no message has; a merely empty array, or one without names, is a loss."""
    for step, there in zip(plan.steps, present, strict=True):
        if not there and isinstance(step.key, str):
            names = plan.type.elements(payload, step.path).names
            if names and step.key not in names:  # a first message may name nothing yet
                remedy = did_you_mean(step.key, names)
                raise RecordingError(
                    f"no message names an element '{step.key}' of {step.path}",
                    where=where,
                    remedy=f"{remedy}; {otherwise}" if otherwise else remedy,
                )
