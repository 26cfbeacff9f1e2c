"""What a reader of the verdict must know: losses, failed checks, bands next to a resonance, weak predictions."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.reduction.analysis import Analysis, bands_of
from kbs_process.reduction.judging import band_of, coverage_below
from kbs_process.reduction.losses import lost
from kbs_process.stages.align.clocks import UNKNOWN_OFFSET_S
from kbs_process.stages.gravity.model import GravityModel
from kbs_process.stages.gravity.quality import Misfit
from kbs_process.stages.verdict import COVERAGE
from kbs_process.studies.correlate import results
from kbs_process.studies.correlate.findings import Findings

# A resonance below this many times a band's edge is next to it: the band then holds part of the resonance's flank.
NEXT_TO = 4.0
# Predictions that explain less of the measured variance than this deserve a word.
WEAK = 0.5
# Repeats with less signal than this many times their noise are dominated by noise.
NOISY = 1.0
# Samples: where fewer are missing together, and at the ends of every record, nothing is lost that matters.
UNJUDGED = 40
# rad, standard deviation: a phase that may lie anywhere in a turn has 1.8.
UNKNOWN_PHASE = 1.0
# Characters of a check's detail that a notice quotes.
LONG = 160
QUANTITY = {"torque": "T", "force": "F"}  # first letter of its channels


def notices(
    campaign: Campaign,
    analyses: Sequence[Analysis],
    model: GravityModel,
    findings: Findings,
    conventions: Sequence[results.Convention],
) -> Iterable[results.Notice]:
    """Yield everything worth a notice, worst first."""
    yield from _conventions(conventions)
    yield from _losses(analyses)
    yield from _unjudged(analyses)
    yield from _static_load(campaign, analyses, model)
    yield from _fit(model)
    yield from _taring(analyses)
    yield from _peaks(campaign, analyses, findings)
    yield from _repeats(campaign, findings)
    yield from _resonance(findings)
    yield from _predictions(findings)
    yield from _phases(campaign, analyses)
    yield from _edges(findings)
    yield from _clocks(analyses)


def _conventions(conventions: Sequence[results.Convention]) -> Iterable[results.Notice]:
    for check in conventions:
        if not check.ok:
            yield results.Notice(
                severity="error",
                what=f"sign or frame: {check.check} is {check.found}, expected {check.expected}",
                remedy="check the topics' fields, the channels' signs and the joints' axes in the parameter files",
            )


def _losses(analyses: Sequence[Analysis]) -> Iterable[results.Notice]:
    """One notice a recording: of each kind how much, and between which times."""
    for analysis in analyses:
        yield from lost(analysis.entry, analysis.run.losses)


def _unjudged(analyses: Sequence[Analysis]) -> Iterable[results.Notice]:
    """Stretches of a recording in which the disturbance is not known, and so in no figure."""
    for analysis in analyses:
        residual = analysis.residual
        edges = np.flatnonzero(np.diff(np.concatenate(([True], residual.valid, [True])).astype(np.int8)))
        stretches = [stretch for stretch in edges.reshape(-1, 2) if np.diff(stretch)[0] > UNJUDGED]
        if stretches:
            start, stop = max(stretches, key=lambda stretch: float(stretch[1] - stretch[0]))
            lost = sum(float(end - begin) for begin, end in stretches) * residual.dt
            yield results.Notice(
                severity="warning",
                what=f"{lost:.1f} s of {len(residual) * residual.dt:.0f} s are in no figure: wrench or angles are "
                f"missing, longest from {residual.t[start]:.1f} s to {residual.t[stop - 1]:.1f} s",
                where=analysis.entry.name,
                remedy="what the article did in that time is not judged: record it again",
            )


def _fit(model: GravityModel) -> Iterable[results.Notice]:
    for check in model.fit.checks:
        if not check.passed:
            detail = check.detail if len(check.detail) < LONG else f"{check.detail[:LONG]} ..."
            yield results.Notice(
                severity="info", what=f"gravity fit, {check.name}: {detail}", remedy="see the gravity fit's table"
            )


def _static_load(campaign: Campaign, analyses: Sequence[Analysis], model: GravityModel) -> Iterable[results.Notice]:
    """A recording whose slow part the model leaves: what is judged or compared is then that load."""
    matter = "the verdict is" if campaign.requirements else "the figures of merit are"
    for analysis in analyses:
        large = [misfit for misfit in analysis.misfits if not misfit.ok]
        if large:
            worst = max(misfit.ratio for misfit in large)
            yield results.Notice(
                severity="warning",
                what=f"an unmodelled static load: below {model.settings.low_pass_Hz:.2g} Hz gravity leaves up to "
                f"{worst:.0f} times what its uncertainty explains (rms: {', '.join(map(_left, large))}); {matter} "
                "about that load rather than the article's own disturbance",
                where=analysis.entry.name,
                remedy="look for what pulls on the article and is in no parameter file (a bungee, a cable, a stop, a "
                "hand): take it off, or judge a recording without it",
            )


def _left(misfit: Misfit) -> str:
    return f"{misfit.channel} {misfit.left:.2g} against {misfit.explained:.2g} {misfit.unit}"


def _taring(analyses: Sequence[Analysis]) -> Iterable[results.Notice]:
    tared = [analysis for analysis in analyses if np.any(analysis.static.taring.noise > 0.0)]
    alone = [analysis.entry.name for analysis in tared if not analysis.static.taring.fitted]
    if alone:
        yield results.Notice(
            severity="info",
            what=f"not in the gravity fit, so tared by themselves: {', '.join(alone)}. One constant a channel was "
            "estimated from each, and nothing else",
            remedy="constants and their uncertainty are in the gravity fit's table",
        )


def _peaks(campaign: Campaign, analyses: Sequence[Analysis], findings: Findings) -> Iterable[results.Notice]:
    """Peaks that noise alone may make: the largest of many samples exceeds the true one, never falls short of it."""
    for requirement in findings.requirements:
        band = band_of(campaign.requirements[findings.requirements.index(requirement)], bands_of(campaign.bands))
        key = (requirement.frame, band.name)
        signals = [one.pairs[key].measured for one in analyses if one.entry.role != "calibration"]
        below = coverage_below(requirement.statistic, signals, band)
        noise = [c for c in requirement.channels if (c.value or 0.0) < below * (c.sigma or 0.0)]
        if requirement.statistic == "peak" and noise:
            each = ", ".join(f"{c.channel} {c.value:.2g} of {below * (c.sigma or 0.0):.2g}" for c in noise)
            yield results.Notice(
                severity="info",
                what=f"these peaks are no larger than noise alone may make them in all recordings together, "
                f"{below:.1f} sigma: {each} {requirement.unit}. The article's own may be anything from zero to the "
                f"measured value and {COVERAGE:g} sigma",
                where=requirement.name,
                remedy="the value is an upper bound; a quieter transducer, or a narrower band, would lower it",
            )


def _repeats(campaign: Campaign, findings: Findings) -> Iterable[results.Notice]:
    """One notice a trajectory, band and frame whose channels differ from run to run by more than they share."""
    if not findings.repeatability:
        yield results.Notice(
            severity="warning" if campaign.requirements else "info",
            what="no trajectory was repeated: the budget holds no repeatability",
            remedy="run every trajectory two or three times",
        )
    judged = {(one.frame, one.band, QUANTITY[one.quantity]) for one in findings.requirements}
    labels = {band.name: band.label for band in findings.bands}
    noisy: dict[str, list[results.Repeatability]] = defaultdict(list)
    for entry in findings.repeatability:
        key = (entry.frame, entry.band, entry.channel[0])
        if key in judged and entry.ratio is not None and entry.ratio < NOISY:
            noisy[f"{entry.trajectory}, {labels[entry.band]}, frame {entry.frame}"].append(entry)
    for where, entries in noisy.items():
        each = ", ".join(
            f"{e.channel} {e.noise_rms:.2g} {e.unit} against "
            + (f"{e.signal_rms:.2g} {e.unit}" if e.signal_rms else "nothing that shows")
            for e in entries
        )
        yield results.Notice(
            severity="warning",
            what=f"noise is larger than what the repeats have in common (rms): {each}",
            where=where,
            remedy="the verdict bounds the disturbance rather than measures it: quieten the transducer, or repeat more",
        )


def _resonance(findings: Findings) -> Iterable[results.Notice]:
    lowest = min(findings.resonances, key=lambda mode: mode.frequency_Hz, default=None)
    if lowest is None:
        return
    for band in findings.bands:
        if band.low_pass_Hz is not None and lowest.frequency_Hz < NEXT_TO * band.low_pass_Hz:
            yield results.Notice(
                severity="info",
                what=f"the article's resonance on the transducer ({lowest.frequency_Hz:.2f} Hz, {lowest.source}) "
                f"amplifies what passes below {band.low_pass_Hz:g} Hz",
                where=band.label,
                remedy="its size is in the uncertainty budget",
            )


def _predictions(findings: Findings) -> Iterable[results.Notice]:
    """Where the prediction can be tested in a requirement's band, and fails; and where it cannot be tested."""
    judged = {(one.frame, one.band, QUANTITY[one.quantity]) for one in findings.requirements}
    of_judged = [merit for merit in findings.merit if (merit.frame, merit.band, merit.channel[0]) in judged]
    noise = [merit for merit in of_judged if at_the_noise(merit)]
    if noise:
        channels = ", ".join(sorted({merit.channel for merit in noise}))
        yield results.Notice(
            severity="info",
            what=f"{channels} in the requirement's band lie within twice their own uncertainty: "
            "the prediction cannot be tested there",
            remedy="look at wider bands and at the transducer (frame T) for the correlation",
        )
    labels = {band.name: band.label for band in findings.bands}
    for merit in of_judged:
        explained = merit.fraction_of_variance
        if not at_the_noise(merit) and explained is not None and explained < WEAK:
            yield results.Notice(
                severity="warning",
                what=f"the prediction explains {100 * explained:.0f} % of the variance of {merit.channel}",
                where=f"{merit.recording}, {labels[merit.band]}, frame {merit.frame}",
                remedy="see figures of merit; phases of cogging and friction are unknown before identification",
            )


def _phases(campaign: Campaign, analyses: Sequence[Analysis]) -> Iterable[results.Notice]:
    """Phases of which nothing is known, in a prediction: its bursts have a size and a time, and no sign."""
    drives = {
        joint.name: [
            name
            for name, quantity in joint.drive.parameters.items()
            if quantity.unit == "rad" and float(quantity.sigma) > UNKNOWN_PHASE
        ]
        for joint in campaign.rig.joints
        if joint.drive is not None
    }
    unknown = [f"{name} ({joint})" for joint, names in drives.items() for name in names]
    if unknown and any(one.predicted is not None for one in analyses):
        yield results.Notice(
            severity="info",
            what=f"phases of which the parameter files know nothing: {', '.join(unknown)}. What they time, as bursts "
            "where tooth passing crosses the resonance, is predicted in size and place, and may be measured with the "
            "opposite sign",
            where="prediction",
            remedy="compare sizes there, not histories; kbs-process identify finds the phases of one article",
        )


def at_the_noise(merit: results.Merit) -> bool:
    """Is a measured channel within twice its own uncertainty?"""
    return merit.sigma is not None and (merit.measured_rms or 0.0) < COVERAGE * merit.sigma


def _clocks(analyses: Sequence[Analysis]) -> Iterable[results.Notice]:
    """Clocks that nothing in the file relates: an uncertainty was assumed, which nobody has measured."""
    unknown: dict[str, list[str]] = defaultdict(list)
    for analysis in analyses:
        for stream, clock in analysis.run.clocks.items():
            if not np.isfinite(clock.sigma_offset_s):
                unknown[stream].append(analysis.entry.name)
    for stream, names in unknown.items():
        yield results.Notice(
            severity="info",
            what=f"the clock of '{stream}' cannot be compared with the wrench's: its stamps are taken as they are, "
            f"with a standard uncertainty of {1e3 * UNKNOWN_OFFSET_S:g} ms in the budget and in an identification",
            where=", ".join(names),
            remedy="let the recorder's own time of every message be written beside the sensors' stamps",
        )


def _edges(findings: Findings) -> Iterable[results.Notice]:
    for band in findings.bands:
        if band.edge_s > 0.0 and band.edge_error:
            yield results.Notice(
                severity="info",
                what=f"within {band.edge_s:.0f} s of the ends the filter errs by more than 0.1 % "
                f"({100 * band.edge_error:.2g} % rms over the record where the spectrum is flat, "
                f"{100 * (band.edge_error_drift or 0.0):.2g} % of what drifts)",
                where=band.label,
                remedy="record longer before and after the motion",
            )
