"""The pipeline on one screen: from a campaign's recordings to its results folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from kbs_process.campaign.analysis import Analysis, analyse
from kbs_process.campaign.config import Campaign, RecordingEntry
from kbs_process.campaign.earlier_diagnosis import keep_diagnosis
from kbs_process.campaign.findings import find
from kbs_process.campaign.held import read_alive
from kbs_process.campaign.output import write_results
from kbs_process.campaign.progress import Progress
from kbs_process.campaign.relief import forces_in, relieved, without_effects
from kbs_process.campaign.settings import gravity_settings, motion_settings
from kbs_process.campaign.store import writing
from kbs_process.campaign.summary import summarise
from kbs_process.campaign.transducer import study
from kbs_process.errors import RecordingError
from kbs_process.report import build, results
from kbs_process.signals.records import Run, Signal
from kbs_process.stages import decouple, gravity, motion
from kbs_process.stages.decouple import Decoupling
from kbs_process.stages.gravity import GravityModel, Sample
from kbs_process.stages.motion import Motion


@dataclass(frozen=True, slots=True)
class Outcome:
    """What the command line tells."""

    verdict_lines: tuple[str, ...]
    requirement_met: bool | None  # None: there is no requirement, or it is undecided
    report: Path


@dataclass(frozen=True, slots=True, eq=False)
class Prepared:
    """A recording on one clock, decoupled, with its joints' motion."""

    entry: RecordingEntry
    raw: Signal
    run: Run
    motion: Motion


def process(campaign: Campaign, target: Path, *, progress: Progress, pdf: bool | None = None) -> Outcome:
    """Process a campaign and put its results in `target`, in one step, when all is done.

    A diagnosis of the same inputs that is there already stays.
    """
    with writing(target) as folder:
        decoupling = decouple.fit(campaign.rig)
        prepared = [_prepare(campaign, entry, decoupling, progress) for entry in campaign.recordings]
        model = _fit_gravity(campaign, prepared, progress)
        analyses = [_analyse(campaign, one, model, progress) for one in prepared]
        with progress.task("Comparing, summing up uncertainties"):
            findings = find(campaign, analyses, model, decoupling)
            summary = summarise(campaign, analyses, model, decoupling, findings)
        with progress.task("Following the transducer's resonance") as task:
            on_transducer = study(campaign, analyses, model.rig, task.update)
        with progress.task("Writing the report"):
            write_results(folder, campaign, analyses, summary, on_transducer)
            keep_diagnosis(campaign, target, folder)
            page = build.build(folder, pdf)
    return _outcome(summary, target / page.name)


def _prepare(
    campaign: Campaign, entry: RecordingEntry, decoupling: Decoupling, progress: Progress
) -> Prepared:
    with progress.task(f"Reading {entry.name}"):
        run = read_alive(campaign, entry, keep=True)
        if run.loads is None:
            raise RecordingError(
                "there is neither wrench nor effort in this recording", where=str(entry.path)
            )
        return Prepared(
            entry,
            run.loads,
            decouple.apply(run, decoupling),
            motion.estimate(run, campaign.rig, motion_settings(campaign)),
        )


def _fit_gravity(campaign: Campaign, prepared: list[Prepared], progress: Progress) -> GravityModel:
    """Fit over calibration and fit recordings; held-out ones are not looked at.

    Nor are those in which the rig pulled at the article, where there are others: what is not known of the pull would be
    taken for weight.
    A rig that is driven by its motion has its inertia fitted too; its commands, if any, drive nothing.
    """
    with progress.task("Fitting gravity and centres of gravity"):
        fitted = [one for one in prepared if one.entry.role != "held-out"]
        free = [one for one in fitted if not forces_in(campaign, one.entry)]
        samples = [
            Sample(
                one.entry.name,
                one.motion,
                without_effects(campaign, one.entry, one.motion, loads, campaign.rig),
                calibration=one.entry.role == "calibration",
            )
            for one in free or fitted
            if (loads := relieved(campaign, one.entry, one.run, one.motion).loads) is not None
        ]
        return gravity.fit(
            samples,
            campaign.rig,
            include_inertia=campaign.drive == "motion",
            settings=gravity_settings(campaign),
        )


def _analyse(campaign: Campaign, one: Prepared, model: GravityModel, progress: Progress) -> Analysis:
    with progress.task(f"Analysing {one.entry.name}") as task:
        run = relieved(campaign, one.entry, one.run, one.motion)
        return analyse(campaign, one.entry, one.raw, run, one.motion, model, task.update)


def _outcome(summary: results.Results, report: Path) -> Outcome:
    """The verdict in words: one line a requirement, then what a reader has to know about it."""
    lines = [summary.verdict.sentence]
    serious = sum(notice.severity != "info" for notice in summary.warnings)
    if serious:
        lines.append(f"{serious} warning{'s' if serious > 1 else ''}: see the top of the report")
    met = {"pass": True, "fail": False}.get(summary.verdict.status)
    return Outcome(tuple(lines), met, report)
