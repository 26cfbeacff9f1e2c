"""Least and greatest value in equal stretches of time, in one pass and bounded memory."""

from __future__ import annotations

import numpy as np

from kbs_process.signals.records import Array, Envelope


class MinMax:
    """At most `stretches` stretches; whenever they are full, neighbours merge and each covers twice the time.

    Exact: no extreme of any sample is lost, and the result does not depend on how the rows arrive.
    """

    def __init__(self, channels: int, stretches: int) -> None:
        self._stretches = stretches - stretches % 2
        self._low: Array = np.full((self._stretches, channels), np.inf)
        self._high: Array = np.full((self._stretches, channels), -np.inf)
        self._length = 1  # samples in a stretch
        self._samples = 0

    def push(self, rows: Array) -> None:
        """Take uniform rows (n, c)."""
        if len(rows) == 0:
            return
        while self._samples + len(rows) > self._length * self._stretches:
            self._double()
        first = self._samples // self._length
        starts = np.arange(first * self._length, self._samples + len(rows), self._length) - self._samples
        starts[0] = 0
        into = slice(first, first + len(starts))
        self._low[into] = np.minimum(self._low[into], np.minimum.reduceat(rows, starts))
        self._high[into] = np.maximum(self._high[into], np.maximum.reduceat(rows, starts))
        self._samples += len(rows)

    def result(self, t0: float, period: float) -> Envelope:
        """Return the stretches; first sample at t0, samples `period` apart, s."""
        used = -(-self._samples // self._length)
        first = np.arange(used) * self._length
        last = np.minimum(first + self._length, self._samples) - 1
        return Envelope(t0 + 0.5 * period * (first + last), self._low[:used].copy(), self._high[:used].copy())

    def _double(self) -> None:
        half = self._stretches // 2
        self._low[:half] = np.minimum(self._low[0::2], self._low[1::2])
        self._high[:half] = np.maximum(self._high[0::2], self._high[1::2])
        self._low[half:], self._high[half:] = np.inf, -np.inf
        self._length *= 2
