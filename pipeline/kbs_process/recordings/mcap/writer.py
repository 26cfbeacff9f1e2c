"""Writing MCAP: deterministic, in the order of log times, and read again before it counts as written."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import replace
from hashlib import blake2b
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from kbs_process.errors import OutputError
from kbs_process.recordings.mcap.chunks import ChunkedFile, message_records
from kbs_process.recordings.mcap.messages.encoding import OutStream
from kbs_process.recordings.mcap.source import open_recording
from kbs_process.recordings.mcap.streams import Stream
from kbs_process.signals.records import Block, Stamps

BATCH = 1 << 16  # messages gathered before some are written
HOLD = 1 << 20  # messages that wait for older ones of another topic
_TOGETHER = 1 << 13  # messages that are laid out at a time


def write_mcap(path: Path, streams: Sequence[OutStream]) -> None:
    """Write whole streams to `path`, as `write_pieces` does, in the order of their log times throughout."""
    if len({stream.topic for stream in streams}) != len(streams):
        raise ValueError("two streams of one topic")
    write_pieces(path, streams, hold=sum(len(stream.log) for stream in streams))


def write_pieces(path: Path, pieces: Iterable[OutStream], *, hold: int = HOLD) -> None:
    """Write pieces of streams to `path` in one step: it holds all of them, verified, or what it held before.

    A topic is known from its first piece, which may be empty: it should come before the second of any other.
    The messages are put in the order of their log times as far as `hold` of them reach: little more than these
    are ever in memory. The same pieces give the same bytes. Raises `OutputError` where the file cannot be
    written, or does not give back what was written to it.
    """
    draft = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with draft.open("wb") as file:
            topics = _write(file, pieces, hold)
            file.flush()
            os.fsync(file.fileno())
        _verify(draft, topics)
        draft.replace(path)
    except OSError as error:
        raise OutputError(f"cannot be written: {error.strerror}", where=str(path)) from error
    finally:
        draft.unlink(missing_ok=True)


class _Digest:
    """What went through, whatever the pieces: how many messages, and a hash of each of their columns."""

    def __init__(self) -> None:
        self.count = 0
        self._hashes = [blake2b(digest_size=16) for _ in range(3)]

    def add(self, data: Block | OutStream) -> None:
        self.count += len(data.stamp)
        # All NaN are one: some encodings have but one. Adding zero makes one of both zeros, which are equal.
        values = np.where(np.isnan(data.values), np.nan, data.values) + 0.0
        for column, known in zip((data.stamp, data.log, values), self._hashes, strict=True):
            known.update(np.ascontiguousarray(column).tobytes())

    def result(self) -> tuple[int, list[bytes]]:
        return self.count, [known.digest() for known in self._hashes]


def _head(stream: OutStream) -> OutStream:
    """Return the stream without its messages."""
    return replace(stream, stamp=stream.stamp[:0].copy(), log=stream.log[:0].copy(), values=stream.values[:0].copy())


class _Topic:
    """A topic being written: its messages that still wait, and what has been written of it."""

    def __init__(self, first: OutStream, number: int) -> None:
        self.head = _head(first)
        self.number = number
        self.written = _Digest()
        self.latest = -1 << 63
        self._pieces: list[OutStream] = []

    def add(self, piece: OutStream) -> None:
        known = np.minimum(piece.stamp, piece.log) >= 0  # before 1970 a message has no time
        like = replace(self.head, stamp=piece.stamp[known], log=piece.log[known], values=piece.values[known])
        if like.fields != self.head.fields:
            raise ValueError(f"{piece.topic}: pieces of different kinds")
        if len(like.log):
            self._pieces.append(like)
            self.latest = max(self.latest, int(like.log.max()))

    def logs(self) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
        """Return the log times of the messages that wait."""
        return np.concatenate([self.head.log[:0], *(piece.log for piece in self._pieces)])

    def take(self, limit: int) -> OutStream:
        """Return, in order, the messages that wait and are older than `limit`."""
        log = self.logs()
        order = np.argsort(log, kind="stable")
        stamp = np.concatenate([self.head.stamp[:0], *(piece.stamp for piece in self._pieces)])
        values = np.concatenate([self.head.values[:0], *(piece.values for piece in self._pieces)])
        split = int(np.searchsorted(log[order], limit))
        go, stay = (
            replace(self.head, stamp=stamp[rows], log=log[rows], values=values[rows])
            for rows in (order[:split], order[split:])
        )
        self._pieces = [stay] if len(stay.log) else []
        return go


def _write(file: BinaryIO, pieces: Iterable[OutStream], hold: int) -> list[_Topic]:
    """Write the pieces; return their topics."""
    whole: ChunkedFile | None = None
    topics: dict[str, _Topic] = {}
    waiting, due = 0, BATCH
    for piece in pieces:
        whole = whole or ChunkedFile(file, "ros2")
        if piece.topic not in topics:
            topics[piece.topic] = _Topic(piece, whole.channel(piece))
        elif waiting >= due:  # only now: before a topic comes again, others may still be unknown
            limit = min(topic.latest for topic in topics.values())
            if waiting > hold:
                logs = np.sort(np.concatenate([topic.logs() for topic in topics.values()]))
                limit = max(limit, int(logs[len(logs) - hold // 2]))
            waiting -= _flush(whole, list(topics.values()), limit)
            due = waiting + BATCH
        topics[piece.topic].add(piece)
        waiting += len(piece.log)
    whole = whole or ChunkedFile(file, "")
    _flush(whole, list(topics.values()), (1 << 63) - 1)
    whole.finish()
    return list(topics.values())


def _flush(whole: ChunkedFile, topics: Sequence[_Topic], limit: int) -> int:
    """Write the messages older than `limit`, of equal age in the order of the topics; return how many."""
    ready = [topic.take(limit) for topic in topics]
    logs = np.concatenate([np.zeros(0, dtype=np.int64), *(stream.log for stream in ready)])
    order = np.argsort(logs, kind="stable")
    which = np.repeat(np.arange(len(ready)), [len(stream.log) for stream in ready])[order]
    done = [0] * len(ready)
    for begin in range(0, len(which), _TOGETHER):
        these = which[begin : begin + _TOGETHER]
        rows = []
        for k, count in enumerate(np.bincount(these, minlength=len(ready)).tolist()):
            part = _part(ready[k], slice(done[k], done[k] + count))
            rows.append(message_records(part, topics[k].number, topics[k].written.count + done[k]))
            done[k] += count
        numbers = np.array([topic.number for topic in topics])[these]
        sizes = np.array([own.shape[1] for own in rows])[these]
        whole.add(numbers, logs[order[begin : begin + _TOGETHER]], sizes, _merged(rows, these, sizes))
    for topic, stream in zip(topics, ready, strict=True):
        topic.written.add(stream)
    return len(which)


def _part(stream: OutStream, rows: slice) -> OutStream:
    return replace(stream, stamp=stream.stamp[rows], log=stream.log[rows], values=stream.values[rows])


def _merged(rows: Sequence[NDArray[np.uint8]], which: Stamps, sizes: Stamps) -> NDArray[np.uint8]:
    """Records of several topics, one after the other, in the order `which` (n,)."""
    starts = np.cumsum(sizes) - sizes
    merged = np.empty(int(sizes.sum()), dtype=np.uint8)
    for k, own in enumerate(rows):
        merged[starts[which == k][:, None] + np.arange(own.shape[1])] = own
    return merged


def _verify(path: Path, topics: Sequence[_Topic]) -> None:
    """Read the file and compare every number with what was to be written."""
    source = open_recording(path)
    found = {topic.head.topic: _Digest() for topic in topics}
    for name, block in source.read([Stream(s.topic, s.topic, s.fields) for s in (t.head for t in topics)]):
        found[name].add(block)
    for topic in topics:
        name = topic.head.topic
        if found[name].result() != topic.written.result():
            raise OutputError(f"{name} does not read back as it was written", where=str(path))
    lost = [loss for loss in source.losses if loss.kind not in ("non-finite", "missing field")]
    if lost:
        raise OutputError(f"reads back with losses: {lost}", where=str(path), remedy="check the disk")
