"""Are a campaign's recordings sound? Each is read as processing reads it, and what that finds is listed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from kbs_process.campaign.config import Campaign
from kbs_process.campaign.held import read_alive
from kbs_process.campaign.progress import Progress
from kbs_process.errors import RecordingError
from kbs_process.signals.records import Loss


@dataclass(frozen=True, slots=True)
class Finding:
    """One recording: what it holds, what it lost, or why it cannot be used."""

    name: str
    role: str
    rates: dict[str, float] = field(default_factory=dict)  # Hz, by stream
    losses: tuple[Loss, ...] = ()
    error: str = ""


def read_through(campaign: Campaign, progress: Progress) -> list[Finding]:
    """Read every recording of the campaign to its end."""
    findings = []
    for entry in campaign.recordings:
        with progress.task(f"Reading {entry.name}"):
            try:
                run = read_alive(campaign, entry, keep=True)
                findings.append(Finding(entry.name, entry.role, dict(run.rates), run.losses))
            except RecordingError as error:
                findings.append(Finding(entry.name, entry.role, error=str(error)))
    return findings


def describe(campaign: Campaign, findings: Sequence[Finding]) -> Iterator[str]:
    """Yield the lines of the listing: a table, then losses and errors, then a summary."""
    rig = campaign.rig
    yield f"{campaign.name}: {campaign.title}"
    yield (
        f"  {len(rig.quantities())} quantities, joints {', '.join(rig.joint_names)}, "
        f"channels {', '.join(rig.channels)}, driven by {campaign.drive}"
    )
    width = max(len(finding.name) for finding in findings)
    for finding in findings:
        state = "unreadable" if finding.error else "lossy" if finding.losses else "clean"
        rates = ", ".join(f"{key} {rate:.5g} Hz" for key, rate in sorted(finding.rates.items()))
        yield f"  {finding.name:<{width}}  {finding.role:<11}  {state:<10}  {rates}".rstrip()
    for finding in findings:
        yield from (f"  {finding.name}: {in_words(loss)}" for loss in finding.losses)
        if finding.error:
            yield f"  {finding.error}"
    bad = sum(bool(finding.error) for finding in findings)
    lossy = sum(bool(finding.losses) for finding in findings)
    recordings = "recording" if len(findings) == 1 else "recordings"
    yield f"{len(findings)} {recordings}: {bad} unreadable, {lossy} with losses"


def in_words(loss: Loss) -> str:
    """Return one line for a loss: what, how many, when, where."""
    start, end = loss.start_s, loss.end_s
    when = (
        ""
        if start is None
        else f" at {start:.4f} s"
        if end in (None, start)
        else f", {start:.4f} to {end:.4f} s"
    )
    detail = f" ({loss.detail})" if loss.detail else ""
    return f"{loss.count} x {loss.kind}{when}, {loss.where}{detail}"
