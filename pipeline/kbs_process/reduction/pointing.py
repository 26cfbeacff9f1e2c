"""Pointing errors of recordings: what the encoders, and an external instrument where there is one, say of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import msgspec
import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.reduction.analysis import Analysis
from kbs_process.results.pointing import Instrument, JudgedPointing, PointingEstimate, RecordedPointing
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Signal
from kbs_process.stages import pointing
from kbs_process.stages.align.clocks import late_sigma
from kbs_process.stages.pointing import MIN_SAMPLES, PointingStatistics
from kbs_process.stages.verdict import COVERAGE, SEVERITY, judge, peak_coverage

NOT_AN_ORBIT = "a recording is shorter than an orbit, and can only show that the variation is too large"

SMOOTHING = 10.0  # s, divides slow variation from random error


def recorded_pointing(analyses: Sequence[Analysis]) -> Iterator[RecordedPointing]:
    """Yield the statistics of every axis of every recording that was commanded; calibrations move to stand still."""
    for analysis in analyses:
        for instrument, one, _ in _statistics(analysis):
            yield RecordedPointing(recording=analysis.entry.name, instrument=instrument, estimate=estimate(one))


def judged_pointing(campaign: Campaign, analyses: Sequence[Analysis], doubt: str) -> Iterator[JudgedPointing]:
    """Judge the limits on pointing by the axis and recording closest to failing; nothing is met if there is a `doubt`.

    An external instrument is believed before the encoder. By an encoder, a statistic may be wrong by its offset, by
    its rounding, and by the rate times what is not known of its clock.
    """
    rows = [(analysis, *row) for analysis in analyses for row in _statistics(analysis)]
    external = {(analysis.entry.name, one.axis) for analysis, instrument, one, _ in rows if instrument == "external"}
    for requirement in campaign.pointing:
        orbit = requirement.statistic == "orbit"
        found: list[tuple[int, float, float, str]] = []
        predicted: list[float] = []
        for analysis, instrument, one, whole in rows:
            value = abs(getattr(one, requirement.statistic))
            if instrument == "predicted":
                predicted.append(value)
            elif instrument == "external" or (analysis.entry.name, one.axis) not in external:
                unread = 0.0 if instrument == "external" else _misread(campaign.rig, analysis, one.axis)
                sigma = float(np.hypot(getattr(one, f"{requirement.statistic}_sigma"), unread))
                below = peak_coverage(one.samples) if orbit else COVERAGE  # noise widens a range
                rank = max(SEVERITY[judge(value, sigma, requirement.limit, below)], int(not whole))
                where = (
                    f"{one.axis} in {analysis.entry.name}, by {instrument}{'' if whole else ', which lacks readings'}"
                )
                found.append((rank, value, sigma, where))
        rank, value, sigma, where = max(found, key=lambda one: (one[0], one[1] + one[2]), default=(1, 0.0, 0.0, ""))
        why = (doubt or (NOT_AN_ORBIT if orbit else "")) if found else "no recording has both commands and angles"
        yield JudgedPointing(
            name=requirement.name,
            statistic=requirement.statistic,
            limit=requirement.limit,
            verdict="undecided" if why and rank < 2 else list(SEVERITY)[rank],
            value=value if found else None,
            sigma=sigma if found else None,
            where=where,
            predicted=max(predicted, default=None),
            doubt=why if rank < 2 else "",
        )


def _misread(rig: Rig, analysis: Analysis, axis: str) -> float:
    """What an encoder may misread, rad, one standard deviation."""
    index = rig.joint_names.index(axis)
    encoder, rate = rig.joints[index].encoder, analysis.motion.qd[:, index]
    own = (0.0, 0.0) if encoder is None else (float(encoder.offset.sigma), float(encoder.step) / 12.0**0.5)
    late = late_sigma(analysis.run.clocks, None, analysis.entry.clock_sigma)
    return float(np.linalg.norm([*own, late * np.sqrt(np.mean(rate**2))]))


def _statistics(analysis: Analysis) -> Iterator[tuple[Instrument, PointingStatistics, bool]]:
    """Statistics of every axis by every instrument, and as predicted, and if none lacks; none of a calibration."""
    run, command = analysis.run, analysis.run.command
    if analysis.entry.role == "calibration" or command is None:
        return
    predicted = None if analysis.predicted is None else analysis.predicted.angle
    sources: dict[Instrument, Signal | None] = {"encoder": run.angle, "external": run.pointing, "predicted": predicted}
    for instrument, actual in sources.items():
        if actual is None or not set(actual.channels) <= set(command.channels):
            continue
        desired = command.values[:, [command.channels.index(name) for name in actual.channels]]
        error = pointing.error(actual, command.t, desired)
        if error.valid.sum() >= MIN_SAMPLES:
            for one in pointing.statistics(error, period=len(error) * error.dt, smoothing=SMOOTHING):
                yield instrument, one, bool(np.ptp(np.flatnonzero(error.valid)) < error.valid.sum())


def estimate(one: PointingStatistics) -> PointingEstimate:
    """Return statistics as results.json holds them."""
    return msgspec.convert(one, PointingEstimate, from_attributes=True)
