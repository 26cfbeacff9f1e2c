"""What a reader of the verdict must know: losses, failed checks, bands next to a resonance, weak predictions."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Sequence
from itertools import zip_longest
from typing import Literal

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.reduction import measurable
from kbs_process.reduction.analysis import Analysis, bands_of
from kbs_process.reduction.judging import band_of, coverage_below
from kbs_process.reduction.losses import lost
from kbs_process.reduction.preparing import Prepared
from kbs_process.reduction.soundness.checking import extent
from kbs_process.report.prose import Prose
from kbs_process.results.judged import Requirement, Soundness
from kbs_process.results.records import Notice, Severity
from kbs_process.signals.records import DROPOUT, SPIKE, Run
from kbs_process.signals.smoothing import smooth
from kbs_process.stages.align.clocks import UNKNOWN_OFFSET_S
from kbs_process.stages.gravity.model import GravityModel
from kbs_process.stages.leftover import description
from kbs_process.stages.verdict import COVERAGE
from kbs_process.studies.correlate.results import WEAK, Merit, ModelVerdict, Repeatability, Results

# A resonance below this many times a band's edge is next to it: the band then holds part of the resonance's flank.
NEXT_TO = 4.0
# Repeats with less signal than this many times their noise are dominated by noise.
NOISY = 1.0
# Samples: where fewer are missing together, and at the ends of every record, nothing is lost that matters.
UNJUDGED = 40
# rad, standard deviation: a phase that may lie anywhere in a turn has 1.8.
UNKNOWN_PHASE = 1.0
# m: no spacecraft is longer.
LONGEST = 100.0
# A limit is seldom this many times above all that was measured, uncertainty included.
FAR = 100.0
LEFT_OUT = (SPIKE, DROPOUT)
QUANTITY = {"torque": "T", "force": "F"}  # first letter of its channels

_SAYS = Prose("kbs_process.studies.correlate", "notices")


def notices(campaign: Campaign, analyses: Sequence[Analysis], model: GravityModel, found: Results) -> Iterable[Notice]:
    """Yield everything worth a notice, worst first."""
    for analysis in analyses:
        yield from lost(analysis.entry, [loss for loss in analysis.run.losses if loss.kind not in LEFT_OUT])
    yield from implausible(campaign, found.requirements)
    yield from _unjudged(analyses)
    told = _unexplained(analyses, found.soundness)
    yield from _static_load(campaign, told, model)
    yield from calibration(told, model)
    for check in model.fit.checks:
        if not check.passed:
            yield _notice("info", "fit", check=check)
    yield from _taring(analyses)
    yield from _peaks(campaign, analyses, found)
    yield from _repeats(campaign, found)
    yield from _resonance(found)
    yield from _predictions(found)
    yield from _phases(campaign, analyses)
    yield from _edges(found)
    yield from _clocks(analyses)


def has_spikes(run: Run) -> bool:
    """Whether readings of a recording were taken for bad ones, and left out."""
    return any(loss.kind in LEFT_OUT for loss in run.losses)


def spikes(
    analyses: Sequence[Analysis], without: Sequence[Requirement], with_them: Sequence[Requirement]
) -> Iterable[Notice]:
    """Readings off all others, by channel and time, and what is judged with and without them."""
    figures = list(zip_longest(without, with_them))
    for analysis in (one for one in analyses if has_spikes(one.run)):
        named = [loss for loss in analysis.run.losses if loss.kind in LEFT_OUT]
        yield _notice("warning", "spikes", analysis.entry.name, named=named, figures=figures)


def unclear(campaign: Campaign, prepared: Sequence[Prepared], requirement: Requirement) -> str:
    """Which of the readings that were left out as bad may be what happened; empty if none may."""
    recordings = [(one.entry, one.run) for one in prepared]
    found = measurable.doubtful(campaign, recordings, requirement.band_Hz[1] or np.inf).items()
    first = {name: [one.start for one in own if one.kind in LEFT_OUT] for name, own in found}
    which = "; ".join(f"{name} at {min(starts):.4f} s" for name, starts in first.items() if starts)
    return f"the verdict hangs on readings that may be a knock, and may be bad ones: {which}" if which else ""


def _notice(severity: Severity, name: str, where: str = "", **facts: object) -> Notice:
    """A notice in the words of its template."""
    return Notice(severity=severity, what=_SAYS(name, **facts), where=where, remedy=_SAYS(f"{name}_remedy", **facts))


def _unjudged(analyses: Sequence[Analysis]) -> Iterable[Notice]:
    """Stretches of a recording in which the disturbance is not known, and so in no figure."""
    for analysis in analyses:
        residual = analysis.residual
        edges = np.flatnonzero(np.diff(np.concatenate(([True], residual.valid, [True])).astype(np.int8)))
        stretches = [stretch for stretch in edges.reshape(-1, 2) if np.diff(stretch)[0] > UNJUDGED]
        if stretches:
            start, stop = max(stretches, key=lambda stretch: float(stretch[1] - stretch[0]))
            yield _notice(
                "warning",
                "unjudged",
                analysis.entry.name,
                lost=sum(float(end - begin) for begin, end in stretches) * residual.dt,
                whole=len(residual) * residual.dt,
                start=residual.t[start],
                end=residual.t[stop - 1],
            )


def implausible(campaign: Campaign, requirements: Iterable[Requirement]) -> Iterable[Notice]:
    """A spacecraft's centre of mass, or a limit, that is where it would be if its unit were another."""
    weight, reach = extent(campaign.rig)
    for one in requirements:
        arm = one.lever_m
        if arm is not None and not reach < arm < LONGEST:
            yield _notice("warning", "lever", one.name, arm=arm, reach=reach, within=arm <= reach)
        static = weight * {"torque": reach + (arm or 0.0), "force": 1.0}[one.quantity] if one.frame != "joint" else 0.0
        beyond = 0.0 < static < one.limit
        if beyond or one.limit > FAR * (one.high or np.inf):
            yield _notice("warning", "limit", one.name, one=one, static=static if beyond else None, far=FAR)


def _unexplained(analyses: Sequence[Analysis], soundness: Soundness) -> Sequence[Analysis]:
    """Recordings in which what gravity leaves is not what a named fault explains: that of others, or of all."""
    reasons = [set(re.findall(r"[\w-]+", reason)) for reason in soundness.reasons if soundness.suggestions]
    of_some = all(any(one.entry.name in words for one in analyses) for words in reasons)
    return [one for one in analyses if of_some and not any(one.entry.name in words for words in reasons)]


def _static_load(campaign: Campaign, analyses: Sequence[Analysis], model: GravityModel) -> Iterable[Notice]:
    """A recording whose slow part the model leaves: what is judged or compared is then that load."""
    for analysis in analyses:
        large = [misfit for misfit in analysis.misfits if not misfit.ok]
        if large:
            yield _notice(
                "warning",
                "static_load",
                analysis.entry.name,
                low_pass=model.settings.low_pass_Hz,
                worst=max(misfit.ratio for misfit in large),
                large=large,
                shown=_shown(analysis, max(large, key=lambda misfit: misfit.ratio).channel, model),
                judged=bool(campaign.requirements),
            )


def calibration(analyses: Sequence[Analysis], model: GravityModel) -> Iterable[Notice]:
    """A calibration that leaves more, slowly, than the noise of a sample: others are held against what it leaves."""
    noise = model.equation.elements.rig.loads.noise[model.equation.index]
    for analysis in (one for one in analyses if one.entry.role == "calibration"):
        for misfit, unexplained, sigma in zip(analysis.misfits, model.unexplained, noise, strict=True):
            most = np.sqrt(max(misfit.explained**2 - unexplained**2, 0.0) + sigma**2)
            if misfit.left > most and sigma > 0.0:
                shown = _shown(analysis, misfit.channel, model)
                facts = {"low_pass": model.settings.low_pass_Hz, "one": misfit, "most": most, "shown": shown}
                yield _notice("info", "calibration", analysis.entry.name, **facts)


def _shown(analysis: Analysis, channel: str, model: GravityModel) -> str:
    """What the data show of what a channel leaves below the fit's low-pass."""
    residual, joints = analysis.residual, [joint.name for joint in model.rig.joints]
    slow = smooth(residual.column(channel)[:, None], residual.dt, model.settings.low_pass_Hz)[:, 0]
    load = analysis.static.wrench.column(channel)
    return f"{channel}: {description(slow, residual.valid, residual.dt, analysis.motion.q, joints, load)}"


def _taring(analyses: Sequence[Analysis]) -> Iterable[Notice]:
    tared = [analysis for analysis in analyses if np.any(analysis.static.taring.noise > 0.0)]
    alone = [analysis.entry.name for analysis in tared if not analysis.static.taring.fitted]
    if alone:
        yield _notice("info", "taring", alone=alone)


def _peaks(campaign: Campaign, analyses: Sequence[Analysis], found: Results) -> Iterable[Notice]:
    """Peaks that noise alone may make: the largest of many samples exceeds the true one, never falls short of it."""
    for asked, requirement in zip(campaign.requirements, found.requirements, strict=True):
        band = band_of(asked, bands_of(campaign.bands))
        key = (requirement.frame, band.name)
        signals = [one.pairs[key].measured for one in analyses if one.entry.role != "calibration"]
        below = coverage_below(requirement.statistic, signals, band)
        noise = [c for c in requirement.channels if (c.value or 0.0) < below * (c.sigma or 0.0)]
        if requirement.statistic == "peak" and noise:
            facts = {"below": below, "noise": noise, "unit": requirement.unit, "coverage": COVERAGE}
            yield _notice("info", "peaks", requirement.name, **facts)


def _judged(found: Results) -> set[tuple[str, str, str]]:
    """Frame, band and first letter of the channels that requirements judge."""
    return {(one.frame, one.band, QUANTITY[one.quantity]) for one in found.requirements}


def _repeats(campaign: Campaign, found: Results) -> Iterable[Notice]:
    """One notice a trajectory, band and frame whose channels differ from run to run by more than they share."""
    if not found.repeatability:
        yield _notice("warning" if campaign.requirements else "info", "no_repeats")
    judged = _judged(found)
    labels = {band.name: band.label for band in found.bands}
    noisy: dict[str, list[Repeatability]] = defaultdict(list)
    for entry in found.repeatability:
        key = (entry.frame, entry.band, entry.channel[0])
        if key in judged and entry.ratio is not None and entry.ratio < NOISY:
            noisy[f"{entry.trajectory}, {labels[entry.band]}, frame {entry.frame}"].append(entry)
    for where, channels in noisy.items():
        yield _notice("warning", "noisy_repeats", where, channels=channels)


def _resonance(found: Results) -> Iterable[Notice]:
    lowest = min(found.resonances, key=lambda mode: mode.frequency_Hz, default=None)
    for band in found.bands:
        edge = band.low_pass_Hz
        if lowest is not None and edge is not None and lowest.frequency_Hz < NEXT_TO * edge:
            yield _notice("info", "resonance", band.label, lowest=lowest, edge=edge)


def model_verdict(found: Results) -> ModelVerdict | None:
    """Whether the model predicts what was measured, where requirements judge, or else unfiltered.

    Recordings held out count, where there are any. Where a disturbance would show, measured or predicted, each channel
    has to be described; where none would show, recordings say nothing of the model.
    """
    compared = _of_judged(found) if found.requirements else [one for one in found.merit if one.band == "unfiltered"]
    compared = [one for one in compared if one.role == "held-out"] or compared
    if not compared:
        return None
    testable = [one for one in compared if one.testable]
    if not testable:
        return ModelVerdict(status="not testable", sentence=_SAYS("model_not_testable", compared=compared))
    worst = min(testable, key=lambda one: (one.correlated, one.fraction_of_variance or 0.0))
    status: Literal["correlated", "not correlated"] = "correlated" if worst.correlated else "not correlated"
    label = next(band.label for band in found.bands if band.name == worst.band)
    sentence = _SAYS("model_tested", worst=worst, label=label, testable=testable, compared=compared)
    return ModelVerdict(status=status, sentence=sentence)


def _of_judged(found: Results) -> list[Merit]:
    judged = _judged(found)
    return [merit for merit in found.merit if (merit.frame, merit.band, merit.channel[0]) in judged]


def _predictions(found: Results) -> Iterable[Notice]:
    """Where the prediction can be tested in a requirement's band, and fails; and where it cannot be tested."""
    of_judged = _of_judged(found)
    noise = {merit.channel for merit in of_judged if merit.at_the_noise}
    if noise:
        yield _notice("info", "untested", channels=sorted(noise))
    labels = {band.name: band.label for band in found.bands}
    for merit in of_judged:
        explained = merit.fraction_of_variance
        if not merit.at_the_noise and explained is not None and explained < WEAK:
            where = f"{merit.recording}, {labels[merit.band]}, frame {merit.frame}"
            facts = {"explained": explained, "channel": merit.channel, "driven": found.campaign.drive == "command"}
            yield _notice("warning", "weak_prediction", where, **facts)


def _phases(campaign: Campaign, analyses: Sequence[Analysis]) -> Iterable[Notice]:
    """Phases of which nothing is known, in a prediction: its bursts have a size and a time, and no sign."""
    phases = [
        f"{name} ({joint.name})"
        for joint in campaign.rig.joints
        if joint.drive is not None
        for name, quantity in joint.drive.parameters.items()
        if quantity.unit == "rad" and float(quantity.sigma) > UNKNOWN_PHASE
    ]
    if phases and any(one.predicted is not None for one in analyses):
        yield _notice("info", "phases", "prediction", phases=phases)


def _edges(found: Results) -> Iterable[Notice]:
    for band in found.bands:
        if band.edge_s > 0.0 and band.edge_error:
            yield _notice("info", "edges", band.label, band=band)


def _clocks(analyses: Sequence[Analysis]) -> Iterable[Notice]:
    """Clocks that nothing in the file relates: an uncertainty was assumed, which nobody has measured."""
    unknown: dict[str, list[str]] = defaultdict(list)
    for analysis in analyses:
        for stream, clock in analysis.run.clocks.items():
            if not np.isfinite(clock.sigma_offset_s):
                unknown[stream].append(analysis.entry.name)
    for stream, names in unknown.items():
        yield _notice("info", "clocks", ", ".join(names), stream=stream, sigma_ms=1e3 * UNKNOWN_OFFSET_S)
