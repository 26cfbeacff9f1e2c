"""Requirements judged: the channel and the recording that are closest to failing decide."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from kbs_process.campaign.analysis import Analysis, bands_of
from kbs_process.campaign.config import Campaign, Requirement
from kbs_process.errors import ConfigError
from kbs_process.report import results
from kbs_process.signals.records import Signal
from kbs_process.stages.bandpass import Band, crossing_rate
from kbs_process.stages.verdict import COVERAGE, Judgement, extremes, judge, peak_coverage

SEVERITY: dict[Judgement, int] = {"pass": 0, "undecided": 1, "fail": 2}


def judged(
    campaign: Campaign,
    requirement: Requirement,
    runs: Sequence[Analysis],
    budgets: Sequence[results.Budget],
) -> results.Requirement:
    """Judge a requirement by the channel and recording that are closest to failing it."""
    band = band_of(requirement, bands_of(campaign.bands))
    key = (requirement.frame, band.name)
    prefix = "T" if requirement.quantity == "torque" else "F"
    pairs = [(analysis.entry.name, analysis.pairs[key]) for analysis in runs if key in analysis.pairs]
    if not pairs:
        raise ConfigError(
            f"nothing was measured in frame {requirement.frame}",
            where=requirement.name,
            remedy="give [spacecraft] in the parameter files and all six channels, or frame = 'T'",
        )
    channels = [channel for channel in pairs[0][1].measured.channels if channel.startswith(prefix)]
    sigmas = {
        entry.channel: entry.total
        for entry in budgets
        if (entry.frame, entry.band) == (requirement.frame, band.name)
    }
    measured = extremes([(name, pair.measured) for name, pair in pairs], channels, requirement.statistic)
    predicted = {
        extreme.channel: extreme.value
        for extreme in extremes(
            [(name, pair.predicted) for name, pair in pairs if pair.predicted is not None],
            channels,
            requirement.statistic,
        )
    }
    worst = max(measured, key=lambda extreme: extreme.value + COVERAGE * sigmas[extreme.channel])
    below = coverage_below(requirement.statistic, [pair.measured for _, pair in pairs], band)
    verdict = max(
        (judge(extreme.value, sigmas[extreme.channel], requirement.limit, below) for extreme in measured),
        key=SEVERITY.__getitem__,
    )
    return results.Requirement(
        name=requirement.name,
        quantity=requirement.quantity,
        frame=requirement.frame,
        statistic=requirement.statistic,
        band=band.name,
        band_Hz=requirement.band,
        limit=requirement.limit,
        unit=requirement.unit,
        value=worst.value,
        sigma=sigmas[worst.channel],
        margin=requirement.limit - worst.value,
        verdict=verdict,
        recording=worst.recording,
        channel=worst.channel,
        time_s=worst.time_s,
        predicted_value=max(predicted.values(), default=None),
        channels=tuple(
            results.ChannelResult(
                channel=extreme.channel,
                value=extreme.value,
                sigma=sigmas[extreme.channel],
                predicted=predicted.get(extreme.channel),
                recording=extreme.recording,
                time_s=extreme.time_s,
            )
            for extreme in measured
        ),
        source=requirement.source,
    )


def coverage_below(statistic: str, measured: Sequence[Signal], band: Band) -> float:
    """Return how many sigmas the true statistic may lie below that of all these signals."""
    if statistic != "peak":
        return COVERAGE
    seconds = sum(float(np.count_nonzero(signal.valid)) * signal.dt for signal in measured)
    return peak_coverage(crossing_rate(band, measured[0].dt) * seconds)


def band_of(requirement: Requirement, bands: Iterable[Band]) -> Band:
    """Return the band in which a requirement is judged: the one with its upper edge.

    Raises ConfigError where the campaign cuts no such band.
    """
    for band in bands:
        if band.low_pass_Hz is not None and np.isclose(band.low_pass_Hz, requirement.band[1]):
            return band
    raise ConfigError(
        f"the requirement ends at {requirement.band[1]:g} Hz, and no band does",
        where=requirement.name,
        remedy=f"add {requirement.band[1]:g} to low_pass_Hz in [bands] of campaign.toml",
    )
