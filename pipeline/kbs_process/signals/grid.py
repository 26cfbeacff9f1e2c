"""Common time grids: signals of one recording lie on multiples of their period."""

from __future__ import annotations

from dataclasses import replace

from kbs_process.errors import RecordingError
from kbs_process.signals.records import Signal


def crop(signal: Signal, start: int, length: int) -> Signal:
    """Return `length` samples of a signal from its sample `start` on."""
    stop = start + length
    return replace(
        signal, t0=signal.t0 + start * signal.dt, values=signal.values[start:stop], valid=signal.valid[start:stop]
    )


def overlap(*signals: Signal) -> tuple[Signal, ...]:
    """Return the stretch of time that all signals share, sample for sample.

    Raises RecordingError where they share none, or where their grids differ by more than 1 % of a period.
    """
    dt = signals[0].dt
    first = [signal.t0 / dt for signal in signals]
    off = [(f - first[0]) - round(f - first[0]) for f in first]
    if any(abs(signal.dt - dt) > 1e-9 * dt for signal in signals) or max(map(abs, off)) > 0.01:
        raise RecordingError("two signals to be compared do not lie on the same time grid")
    starts = [round(f - first[0]) for f in first]
    begin = max(starts)
    end = min(start + len(signal) for start, signal in zip(starts, signals, strict=True))
    if end <= begin:
        raise RecordingError(
            "two signals to be compared have no common time",
            remedy="look at their start and end with 'kbs-process inspect'",
        )
    return tuple(crop(s, begin - start, end - begin) for s, start in zip(signals, starts, strict=True))
