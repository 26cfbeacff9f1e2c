"""Can a campaign be processed? It is read and fitted as processing does it, and what that finds is listed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

from kbs_process.campaign.config import Campaign, RecordingEntry
from kbs_process.campaign.mission import boundaries, load_day
from kbs_process.errors import KbsError, RecordingError
from kbs_process.mission.planner import plan
from kbs_process.progress import Progress
from kbs_process.reduction.losses import in_words
from kbs_process.reduction.measurable import check_requirements
from kbs_process.reduction.preparing import Prepared, check_taring, fit_gravity, prepare, told_copies
from kbs_process.reduction.soundness.checking import check_model
from kbs_process.results.records import Notice
from kbs_process.signals.records import Loss
from kbs_process.stages import decouple
from kbs_process.stages.gravity.model import GravityModel


@dataclass(frozen=True, slots=True)
class Finding:
    """One recording: what it holds, what it lost, or why it cannot be used."""

    name: str
    role: str
    rates: dict[str, float] = field(default_factory=dict)  # Hz, by stream
    losses: tuple[Loss, ...] = ()
    error: str = ""

    @property
    def lossy(self) -> bool:
        return any(loss.real for loss in self.losses)


@dataclass(frozen=True, slots=True)
class Validation:
    """What was found, recording by recording, and why processing would refuse them all together."""

    findings: tuple[Finding, ...]
    refusal: str = ""
    notices: tuple[Notice, ...] = ()  # what is wrong with the model of the rig
    day: str = ""  # what is planned, where there is a mission

    @property
    def refused(self) -> bool:
        return bool(self.refusal) or any(finding.error for finding in self.findings)


def validate(campaign: Campaign, progress: Progress) -> Validation:
    """Read every recording of the campaign to its end; if all can, fit gravity and compare it with the files.

    The day of a mission is planned and cut into its sections.
    """
    day = ""
    decoupling = decouple.fit(campaign.rig)
    findings: list[Finding] = []
    prepared: list[Prepared] = []
    notices: tuple[Notice, ...] = ()
    for entry in campaign.recordings:
        try:
            one = prepare(campaign, entry, decoupling, progress)
        except RecordingError as error:
            findings.append(Finding(entry.name, entry.role, error=str(error)))
        else:
            prepared.append(one)
            findings.append(Finding(entry.name, entry.role, dict(one.run.rates)))
    losses = {one.entry.name: one.run.losses for one in told_copies(prepared)}
    findings = [replace(finding, losses=losses.get(finding.name, ())) for finding in findings]
    try:
        day = _planned(campaign) if campaign.mission else ""
        if findings:
            check_requirements(campaign)
        if findings and len(prepared) == len(findings):
            model = fit_gravity(campaign, prepared, progress)
            findings = [
                replace(finding, error=_untared(campaign, one, model))
                for finding, one in zip(findings, prepared, strict=True)
            ]
            if not any(finding.error for finding in findings):
                notices = tuple(check_model(campaign, prepared, model, progress).notices())
    except KbsError as error:
        return Validation(tuple(findings), str(error))
    return Validation(tuple(findings), notices=notices, day=day)


def _planned(campaign: Campaign) -> str:
    day = load_day(campaign)
    planned = plan(day.mission, day.lead)
    sections = boundaries(day, planned)
    slews = sum(phase.mode in ("hand-over", "pre-pointing") for phase in planned.phases)
    return f"mission: {day.mission.duration:g} s in {len(sections)} sections, {slews} slews between relay satellites"


def _untared(campaign: Campaign, one: Prepared, model: GravityModel) -> str:
    """Why gravity cannot be taken off a recording, or nothing."""
    try:
        check_taring(campaign, one, model)
    except RecordingError as error:
        return str(error)
    return ""


def describe(campaign: Campaign, validation: Validation) -> Iterator[str]:
    """Yield the lines of the listing: a table, then losses and errors, then a summary."""
    findings = validation.findings
    rig = campaign.rig
    yield f"{campaign.name}: {campaign.title}"
    yield (
        f"  {len(rig.quantities())} quantities, joints {', '.join(rig.joint_names)}, "
        f"channels {', '.join(rig.channels)}, driven by {campaign.drive}"
    )
    width = max((len(finding.name) for finding in findings), default=0)
    for finding in findings:
        state = "refused" if finding.error else "lossy" if finding.lossy else "clean"
        rates = ", ".join(f"{key} {rate:.5g} Hz" for key, rate in sorted(finding.rates.items()))
        yield f"  {finding.name:<{width}}  {finding.role:<11}  {state:<10}  {rates}".rstrip()
    for finding in findings:
        yield from (f"  {finding.name}: {in_words(loss)}" for loss in finding.losses)
        if finding.error:
            yield from f"  {finding.error}".split("\n")
    bad = sum(bool(finding.error) for finding in findings)
    lossy = sum(finding.lossy for finding in findings)
    recordings = "recording" if len(findings) == 1 else "recordings"
    yield f"{len(findings)} {recordings}: {bad} refused, {lossy} with losses"
    if validation.day:
        yield validation.day
    if validation.refusal:
        yield from f"cannot be processed: {validation.refusal}".split("\n")
    for notice in validation.notices:
        yield f"{notice.severity}: {notice.what}"
        yield f"  -> {notice.remedy}"
    if hint := repeatability_hint(campaign):
        yield from f"hint: {hint}".split("\n")


def repeatability_hint(campaign: Campaign) -> str:
    """Say what a campaign without repeats goes without, and what is taken instead; nothing of one that has some."""
    judged = [entry for entry in campaign.recordings if entry.role != "calibration"]
    if not judged or _repeats(judged):
        return ""
    # What `diagnosis.floor` and the budget do; a calibration is part of the former alone.
    floor = (
        ""
        if _repeats(campaign.recordings)
        else ", and diagnose takes what the parameter files say of the sensors' noise and rounding for its floor"
    )
    return (
        "no trajectory is repeated: what differs from run to run is not known, the uncertainty budget has no "
        f"repeatability{floor}\n  -> record a trajectory two or three times, and list each run with its `repeat`"
    )


def _repeats(entries: Sequence[RecordingEntry]) -> bool:
    """Whether two recordings are runs of one trajectory."""
    return len({entry.trajectory for entry in entries}) < len(entries)
