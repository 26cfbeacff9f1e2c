"""What a campaign leaves out of its verdict by its own words, calibrations and what is cut off, and its figure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import msgspec

from kbs_process.campaign.config import Campaign, RecordingEntry
from kbs_process.errors import KbsError
from kbs_process.progress import Progress
from kbs_process.reduction.analysis import Analysis, analyse, bands_of
from kbs_process.reduction.judging import judged
from kbs_process.reduction.preparing import prepare
from kbs_process.reduction.relief import relieved
from kbs_process.results.judged import Requirement
from kbs_process.stages.decouple import Decoupling
from kbs_process.stages.gravity.model import GravityModel
from kbs_process.studies.correlate.findings import statements
from kbs_process.studies.correlate.results import Results
from kbs_process.studies.correlate.summary import conclusion
from kbs_process.studies.correlate.uncertainty import budgets


def with_left_out(
    campaign: Campaign,
    found: Results,
    analyses: Sequence[Analysis],
    model: GravityModel,
    decoupling: Decoupling,
    progress: Progress,
) -> Results:
    """Return results whose requirements tell what the campaign leaves out, and what is judged of that by itself."""
    left = [one for one in analyses if _named(one.entry)]
    if not left:
        return found
    words = f"The campaign leaves out {', '.join(_named(one.entry) for one in left)}."
    try:
        whole = [_whole(campaign, one, model, decoupling, progress) for one in left]
        stated = statements(bands_of(campaign.bands), whole)
        rows = tuple(budgets(campaign, whole, model, decoupling, stated, found.repeatability, found.resonances, {}))
        others = [_words(judged(campaign, asked, whole, rows)) for asked in campaign.requirements]
    except KbsError as error:
        others = [("undecided", f"By itself that cannot be judged: {error.what}.")] * len(found.requirements)
    told = [
        msgspec.structs.replace(one, left_out=f"{words} {what}", only_without=one.verdict == "pass" != verdict)
        for one, (verdict, what) in zip(found.requirements, others, strict=True)
    ]
    return msgspec.structs.replace(found, requirements=tuple(told), verdict=conclusion(told))


def _words(one: Requirement) -> tuple[str, str]:
    """A verdict on what is left out, and the figure."""
    words = {"pass": "met", "fail": "not met", "undecided": "undecided"}[one.verdict]
    figure = f"{one.value or 0.0:.4f} {one.unit} ({one.low or 0.0:.4f} to {one.high or 0.0:.4f} at 95 %)"
    return one.verdict, f"By itself that is {words}: {one.statistic} {figure} on {one.channel} in {one.recording}."


def _named(entry: RecordingEntry) -> str:
    """What the campaign leaves out of a recording; empty where it is judged from beginning to end."""
    parts = ["(calibration)"] if entry.role == "calibration" else []
    parts += [f"{which} {at:g} s" for which, at in (("before", entry.start), ("after", entry.end)) if at is not None]
    return " ".join([entry.name, *parts]) if parts else ""


def _whole(
    campaign: Campaign, one: Analysis, model: GravityModel, decoupling: Decoupling, progress: Progress
) -> Analysis:
    """All of a recording, analysed as a calibration is: nothing is predicted of it."""
    entry = replace(one.entry, role="calibration", start=None, end=None)
    if entry == one.entry:
        return one
    read = prepare(campaign, entry, decoupling, progress)
    run = relieved(campaign, entry, read.run, read.motion)
    return analyse(campaign, entry, read.raw, run, read.motion, model, lambda _: None)
