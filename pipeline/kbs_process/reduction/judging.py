"""Requirements judged: the channel and the recording that are closest to failing decide."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from typing import Literal

import msgspec
import numpy as np

from kbs_process.campaign.config import Campaign, Requirement
from kbs_process.errors import ConfigError
from kbs_process.reduction.analysis import Analysis, bands_of
from kbs_process.reduction.measurable import judged_channels
from kbs_process.results import judged as results
from kbs_process.results.judged import Doubt
from kbs_process.signals.records import Signal
from kbs_process.stages import bandpass
from kbs_process.stages.bandpass import Band, bridging_error, crossing_rate
from kbs_process.stages.six_channels import Together
from kbs_process.stages.verdict import COVERAGE, SEVERITY, Extreme, Judgement, extremes, interval, judge, peak_coverage

_NONE: Mapping[str, float] = {}
_NO_OTHER: Mapping[tuple[str, str], Together] = {}
MOSTLY = 0.25  # of a band's filter may lean on what is not known, where a value still tells that something was there


@dataclass(frozen=True, slots=True)
class _Candidate:
    """One channel of one recording against the limit, by its own uncertainty."""

    extreme: Extreme
    sigma: float
    limit: float
    below: float  # sigmas that the true statistic may lie below
    together: bool = False  # by all six channels at once

    @property
    def interval(self) -> tuple[float, float]:
        return interval(self.extreme.value, self.sigma, self.below)

    @property
    def verdict(self) -> Judgement:
        return judge(self.extreme.value, self.sigma, self.limit, self.below)

    def severity(self) -> tuple[int, float]:
        """Order of candidates: the worst verdict, then the highest end of the interval."""
        return SEVERITY[self.verdict], self.interval[1]


def judged(
    campaign: Campaign,
    requirement: Requirement,
    runs: Sequence[Analysis],
    budgets: Sequence[results.Budget],
    doubts: Sequence[Doubt] = (),
    rounding: Mapping[str, float] = _NONE,
    mute: Sequence[str] = (),
    unconfirmed: Sequence[str] = (),
    together: Mapping[tuple[str, str], Together] = _NO_OTHER,
) -> results.Requirement:
    """Judge a requirement by the channel and recording that are closest to failing it, if no doubt forbids it.

    `rounding`: standard deviation, by channel, of readings that are rounded more coarsely than is stated.
    `mute`: channels that no recording shows to respond; `unconfirmed`: those whose slope no load tests.
    `together`: by recording and band, all six channels at once. It counts at the spacecraft where rigid bodies explain
    it and it agrees with what was moved by the measured forces; where it does not agree, the worse of both counts.
    """
    band = band_of(requirement, bands_of(campaign.bands))
    key = (requirement.frame, band.name)
    channels = judged_channels(requirement, campaign.rig)
    pairs = [(analysis.entry.name, analysis.pairs[key]) for analysis in runs]
    signals = [(name, pair.measured) for name, pair in pairs]
    below = coverage_below(requirement.statistic, [signal for _, signal in signals], band)
    usual = {(one.recording, one.channel): one.value for one in extremes(signals, channels, "rms")}
    own = {(one.recording, one.channel): one for one in budgets if (one.frame, one.band) == key}

    def sigma(one: Extreme) -> float:
        """What a statistic may be wrong by: what grows with the signal is more at a peak than over the recording."""
        place = one.recording, one.channel
        crest = max(one.value / usual[place], 1.0) if usual[place] > 0.0 else 1.0
        grows = sum(item.sigma**2 for item in own[place].contributions if item.grows)
        return float(np.sqrt(own[place].total ** 2 + (crest**2 - 1.0) * grows + rounding.get(one.channel, 0.0) ** 2))

    hides = {analysis.entry.name: bridging_error(analysis.run.gaps, band) for analysis in runs}
    measured = [
        _Candidate(
            extreme, float(np.hypot(sigma(extreme), hides[extreme.recording] * extreme.value)), requirement.limit, below
        )
        for extreme in extremes(signals, channels, requirement.statistic)
    ]
    if not measured:
        raise ConfigError(
            f"no sample of {band.name} is known: near a recording's ends and gaps, to some periods of its lower "
            "edge, none is",
            where=requirement.name,
            remedy="record longer, or raise the band's lower edge",
        )
    both = [
        _both_ways(
            one,
            likely,
            pair.measured,
            own,
            requirement.statistic,
            band,
            hides[name],
            rounding.get(one.extreme.channel, 0.0),
        )
        for one in measured
        for name, pair in pairs
        if name == one.extreme.recording and requirement.frame == "S"
        if (likely := together.get((name, band.name))) is not None and likely.explained
    ]
    ways = tuple(way for _, way in both)
    agreed = {(way.recording, way.channel) for way in ways if way.agree}
    measured = [one for one in measured if (one.extreme.recording, one.extreme.channel) not in agreed]
    measured += [one for one, _ in both]
    predicted = extremes(
        [(name, pair.predicted) for name, pair in pairs if pair.predicted is not None], channels, requirement.statistic
    )
    worst = max(measured, key=_Candidate.severity)
    beside = [
        _Candidate(extreme, sigma(extreme), requirement.limit, below)
        for extreme in extremes(
            [(one.entry.name, _beside(one, one.pairs[key].measured, band)) for one in runs],
            channels,
            requirement.statistic,
        )
        if requirement.statistic == "peak" and (extreme.recording, extreme.channel) in own
    ]
    doubts = (*doubts, *(_unsure(one, requirement.unit) for one in beside if one.verdict != "pass"))
    silent = tuple(channel for channel in channels if channel in mute)
    others = [key for key in unconfirmed if key[0] == channels[0][0] and key not in channels]
    beyond = [one for one in extremes(signals, others, requirement.statistic) if one.value > requirement.limit]
    if silent and beyond:
        read = f"{beyond[0].channel}, which is not judged, is beyond the limit in {beyond[0].recording}"
        why = f"nothing shows a response of {', '.join(silent)}, and {read}: they may be swapped"
        doubts = (*doubts, Doubt(why, of_failed=False))
    doubt = next((one.why for one in doubts if one.of_failed or worst.verdict != "fail"), "")
    return results.Requirement(
        name=requirement.name,
        quantity=requirement.quantity,
        frame=requirement.frame,
        statistic=requirement.statistic,
        band=band.name,
        band_Hz=requirement.band,
        limit=requirement.limit,
        unit=requirement.unit,
        value=worst.extreme.value,
        sigma=worst.sigma,
        low=worst.interval[0],
        high=worst.interval[1],
        margin=requirement.limit - worst.extreme.value,
        verdict="undecided" if doubt else worst.verdict,
        doubt=doubt,
        recording=worst.extreme.recording,
        channel=worst.extreme.channel,
        time_s=worst.extreme.time_s,
        predicted_value=max((extreme.value for extreme in predicted), default=None),
        channels=tuple(
            _channel(channel, measured, predicted)
            for channel in channels
            if any(one.extreme.channel == channel for one in measured)
        ),
        mute=silent,
        together=worst.together,
        ways=ways,
        untested=set(campaign.rig.channels) <= set(unconfirmed),
        source=requirement.source,
        axes=requirement.axes,
        lever_m=None
        if campaign.rig.spacecraft is None or requirement.frame != "S"
        else float(np.linalg.norm(campaign.rig.spacecraft.position.value)),
    )


def _both_ways(
    moved: _Candidate,
    likely: Together,
    signal: Signal,
    budgets: Mapping[tuple[str | None, str], results.Budget],
    statistic: Literal["peak", "rms"],
    band: Band,
    hidden: float,
    rounding: float,
) -> tuple[_Candidate, results.Way]:
    """The candidate of all six channels at once, beside the one whose `signal` was moved by the measured forces.

    Its uncertainty is that of the estimate, at a peak as many times what grows with it as the peak is above the rms;
    and in the same proportion what the other's budget has of errors that grow, such as that of a gain.
    """
    recording, channel = moved.extreme.recording, moved.extreme.channel
    at, own = signal.channels.index(channel), budgets[recording, channel]
    (extreme,), (usual,), (before,) = (
        extremes([(recording, one)], (channel,), kind)
        for one, kind in ((likely.wrench, statistic), (likely.wrench, "rms"), (signal, "rms"))
    )
    crest = max(extreme.value / usual.value, 1.0) if usual.value > 0.0 else 1.0
    grows = float(np.sqrt(sum(item.sigma**2 for item in own.contributions if item.grows)))
    share = grows / before.value if before.value > 0.0 else 0.0
    sigma = np.sqrt(
        likely.sigma[at] ** 2
        + (crest * likely.bodies[at]) ** 2
        + (share**2 + hidden**2) * extreme.value**2
        + rounding**2
    )
    candidate = replace(moved, extreme=extreme, sigma=float(sigma), together=True)
    totals = np.array([budgets[recording, name].total for name in signal.channels])
    agree = bool(likely.agrees(signal, totals, coverage_below("peak", [signal], band))[at])
    return candidate, results.Way(
        recording=recording,
        channel=channel,
        moved=(moved.extreme.value, *moved.interval),
        together=(extreme.value, *candidate.interval),
        agree=agree,
    )


def _beside(analysis: Analysis, measured: Signal, band: Band) -> Signal:
    """A band's signal where it was recorded and leans on what was not: beside gaps, and at the ends."""
    there = analysis.residual.valid.copy()
    short = round(bandpass.NEAR / measured.dt)
    there[:short] |= there[:short].any()
    there[-short:] |= there[-short:].any()
    edge = band.low_pass_Hz
    mostly = there if edge is None else there & bandpass.known_within(there, edge, measured.dt, MOSTLY)
    return replace(measured, valid=mostly & ~measured.valid)


def _unsure(one: _Candidate, unit: str) -> Doubt:
    """What was recorded beside a gap or at an end, and may be beyond the limit."""
    at = one.extreme
    what = f"whether {at.channel} of {at.recording} stays within {one.limit:g} {unit} at {at.time_s or 0.0:.2f} s"
    found = f"about {at.value:.4f} +- {COVERAGE * one.sigma:.2g} {unit} by what was recorded"
    why = f"{what} is not known: {found}, but next to a gap or an end the band's filter needs what lies beyond"
    return Doubt(why, of_failed=False)


def decided(
    without: Sequence[results.Requirement], kept: Sequence[results.Requirement], doubts: Sequence[str]
) -> tuple[results.Requirement, ...]:
    """Requirements judged `without` what looks like bad readings; of one with a doubt, if it is judged alike with them.

    `kept` are those judged with them, none if that cannot be.
    """
    return tuple(
        one
        if not doubt or (other is not None and one.verdict == other.verdict)
        else msgspec.structs.replace(one, verdict="undecided", doubt=one.doubt or doubt)
        for one, other, doubt in zip_longest(without, kept, doubts)
    )


def _channel(channel: str, measured: Sequence[_Candidate], predicted: Sequence[Extreme]) -> results.ChannelResult:
    """The recording in which a channel is closest to failing, beside the largest prediction of any."""
    worst = max((one for one in measured if one.extreme.channel == channel), key=_Candidate.severity)
    return results.ChannelResult(
        channel=channel,
        value=worst.extreme.value,
        sigma=worst.sigma,
        low=worst.interval[0],
        high=worst.interval[1],
        predicted=max((one.value for one in predicted if one.channel == channel), default=None),
        recording=worst.extreme.recording,
        time_s=worst.extreme.time_s,
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
