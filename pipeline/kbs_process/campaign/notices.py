"""What a reader of the verdict must know: losses, failed checks, bands next to a resonance, weak predictions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from kbs_process.campaign.analysis import Analysis
from kbs_process.campaign.config import Campaign
from kbs_process.campaign.findings import Findings
from kbs_process.report import results
from kbs_process.stages.gravity import GravityModel

# A resonance below this many times a band's edge is next to it: the band then holds part of the resonance's flank.
NEXT_TO = 4.0
# Predictions that explain less of the measured variance than this deserve a word.
WEAK = 0.5
# Repeats with less signal than this many times their noise are dominated by noise.
NOISY = 1.0


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
    yield from _fit(model)
    yield from _repeats(campaign, findings)
    yield from _resonance(findings)
    yield from _predictions(findings)
    yield from _edges(findings)


def _conventions(conventions: Sequence[results.Convention]) -> Iterable[results.Notice]:
    for check in conventions:
        if not check.ok:
            yield results.Notice(
                severity="error",
                what=f"sign or frame: {check.check} is {check.found}, expected {check.expected}",
                remedy="check the topics' fields, the channels' signs and the joints' axes in the parameter files",
            )


def _losses(analyses: Sequence[Analysis]) -> Iterable[results.Notice]:
    for analysis in analyses:
        if analysis.run.losses:
            kinds: dict[str, int] = {}
            for loss in analysis.run.losses:
                kinds[loss.kind] = kinds.get(loss.kind, 0) + max(loss.count, 1)
            yield results.Notice(
                severity="warning",
                what="; ".join(f"{kind}: {count}" for kind, count in kinds.items()),
                where=analysis.entry.name,
                remedy=f"kbs-process inspect recordings/{analysis.entry.path.name} lists each with its time",
            )


def _fit(model: GravityModel) -> Iterable[results.Notice]:
    for check in model.fit.checks:
        if not check.passed:
            yield results.Notice(severity="info", what=f"gravity fit, {check.name}: {check.detail}")


def _repeats(campaign: Campaign, findings: Findings) -> Iterable[results.Notice]:
    if not findings.repeatability:
        yield results.Notice(
            severity="warning" if campaign.requirements else "info",
            what="no trajectory was repeated: the budget holds no repeatability",
            remedy="run every trajectory two or three times",
        )
    wanted = {(one.frame, one.band, one.quantity[0].upper()) for one in findings.requirements}
    for entry in findings.repeatability:
        if (
            (entry.frame, entry.band, entry.channel[0]) in wanted
            and entry.ratio is not None
            and entry.ratio < NOISY
        ):
            yield results.Notice(
                severity="warning",
                what=f"{entry.channel} does not repeat: noise {entry.noise_rms:.3g} {entry.unit} rms "
                f"against a signal of {entry.signal_rms:.3g}",
                where=f"{entry.trajectory}, {entry.band}, frame {entry.frame}",
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
    judged = {(one.frame, one.band): one for one in findings.requirements}
    for merit in findings.merit:
        requirement = judged.get((merit.frame, merit.band))
        if requirement is None or merit.channel[0] != ("T" if requirement.quantity == "torque" else "F"):
            continue
        if merit.fraction_of_variance is not None and merit.fraction_of_variance < WEAK:
            yield results.Notice(
                severity="info",
                what=f"the prediction explains {100 * merit.fraction_of_variance:.0f} % of the variance of "
                f"{merit.channel} in the requirement's band",
                where=f"{merit.recording}, frame {merit.frame}",
                remedy="see figures of merit: phases of cogging and friction are unknown before identification",
            )


def _edges(findings: Findings) -> Iterable[results.Notice]:
    for band in findings.bands:
        if band.edge_s > 0.0 and band.edge_error:
            yield results.Notice(
                severity="info",
                what=f"within {band.edge_s:.0f} s of the ends the filter errs by more than 0.1 % "
                f"({100 * band.edge_error:.2g} % rms over the record)",
                where=band.label,
                remedy="record longer before and after the motion",
            )
