"""Pointing errors of recordings: what the encoders, and an external instrument where there is one, say of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal

import msgspec

from kbs_process.reduction.analysis import Analysis
from kbs_process.results.pointing import PointingEstimate, RecordedPointing
from kbs_process.signals.records import Run, Signal
from kbs_process.stages import pointing
from kbs_process.stages.pointing import MIN_SAMPLES, PointingStatistics

Instrument = Literal["encoder", "external"]

SMOOTHING = 10.0  # s, divides slow variation from random error


def recorded_pointing(analyses: Sequence[Analysis]) -> Iterator[RecordedPointing]:
    """Yield the statistics of every axis of every recording that was commanded; calibrations move to stand still."""
    for analysis in analyses:
        if analysis.entry.role == "calibration":
            continue
        run = analysis.run
        if run.angle is not None:
            yield from _against_command(run, run.angle, "encoder")
        if run.pointing is not None:
            yield from _against_command(run, run.pointing, "external")


def _against_command(run: Run, actual: Signal, instrument: Instrument) -> Iterator[RecordedPointing]:
    command = run.command
    if command is None or not set(actual.channels) <= set(command.channels):
        return
    desired = command.values[:, [command.channels.index(name) for name in actual.channels]]
    error = pointing.error(actual, command.t, desired)
    if error.valid.sum() < MIN_SAMPLES:
        return
    for one in pointing.statistics(error, period=len(error) * error.dt, smoothing=SMOOTHING):
        yield RecordedPointing(recording=run.name, instrument=instrument, estimate=estimate(one))


def estimate(one: PointingStatistics) -> PointingEstimate:
    """Return statistics as results.json holds them."""
    return msgspec.convert(one, PointingEstimate, from_attributes=True)
