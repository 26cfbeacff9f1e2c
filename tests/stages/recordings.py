"""Recordings made to order for the tests of this folder: clocks, latencies and damage under control."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from kbs_process.signals.records import Block

EPOCH = 1_700_000_000_000_000_000
Function = Callable[[np.ndarray], np.ndarray]


def stream(
    function: Function,
    rate: float,
    seconds: float,
    *,
    start: float = 0.0,
    offset: float = 0.0,
    skew: float = 0.0,
    latency: float = 1e-3,
    seed: int = 0,
    times: np.ndarray | None = None,
) -> Block:
    """A sensor whose clock reads (t - offset) / (1 + skew) at true time t; the recorder's reads t.

    Latency is 0.2 ms and an exponential tail of mean `latency`.
    """
    t = start + np.arange(round(seconds * rate)) / rate if times is None else times
    rng = np.random.default_rng(seed)
    stamp = EPOCH + np.rint((t - offset) / (1.0 + skew) * 1e9).astype(np.int64)
    log = EPOCH + np.rint((t + 2e-4 + rng.exponential(latency, len(t))) * 1e9).astype(np.int64)
    return Block(stamp, log, function(t))


def rows(block: Block, which: object) -> Block:
    return Block(block.stamp[which], block.log[which], block.values[which])  # type: ignore[index]


def chunks(streams: dict[str, Block], seed: int, mean: float) -> Iterator[tuple[str, Block]]:
    """Interleave streams in the order of a file, cut into chunks of random length."""
    rng = np.random.default_rng(seed)
    position = dict.fromkeys(streams, 0)
    while any(position[key] < len(block) for key, block in streams.items()):
        left = {key: block for key, block in streams.items() if position[key] < len(block)}
        key = min(left, key=lambda k: left[k].log[position[k]])
        stop = position[key] + 1 + int(rng.exponential(mean))
        yield key, rows(streams[key], slice(position[key], stop))
        position[key] = stop
