"""The pipeline on one screen: from a campaign's recordings to its results folder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import msgspec

from kbs_process.campaign.config import Campaign, RecordingEntry
from kbs_process.errors import FitError, RecordingError, SimulationError
from kbs_process.progress import Progress
from kbs_process.reduction.analysis import Analysis, analyse
from kbs_process.reduction.judging import decided
from kbs_process.reduction.measurable import check_requirements
from kbs_process.reduction.preparing import Prepared, fit_gravity, prepare, samples, told_copies
from kbs_process.reduction.relief import relieved
from kbs_process.reduction.soundness.checking import check_model
from kbs_process.report.build import publish
from kbs_process.report.text import count
from kbs_process.results.judged import Requirement
from kbs_process.results.outcome import Outcome
from kbs_process.results.store import writing
from kbs_process.stages import decouple
from kbs_process.stages.decouple import Decoupling
from kbs_process.stages.gravity.ladder import ladder
from kbs_process.stages.gravity.model import GravityModel
from kbs_process.studies.correlate import instruments, orders
from kbs_process.studies.correlate.earlier_diagnosis import keep_diagnosis
from kbs_process.studies.correlate.notices import has_spikes, spikes, unclear
from kbs_process.studies.correlate.output import write_tables
from kbs_process.studies.correlate.results import Results
from kbs_process.studies.correlate.summary import conclusion, summarise, with_left_out
from kbs_process.studies.correlate.transducer import study


def process(
    campaign: Campaign, target: Path, *, progress: Progress, pdf: bool | None = None, page: bool = True
) -> Outcome:
    """Process a campaign and put its results in `target`, in one step, when all is done.

    A diagnosis of the same inputs that is there already stays. Without `page`, results.json and the tables are
    written alone, of which the report can be rendered later.
    """
    check_requirements(campaign)
    with writing(target) as folder:
        decoupling = decouple.fit(campaign.rig)
        prepared = told_copies([prepare(campaign, entry, decoupling, progress) for entry in campaign.recordings])
        found, analyses, model = _found(campaign, prepared, decoupling, progress)
        if any(has_spikes(one.run) for one in prepared):
            kept = _with_spikes(campaign, prepared, decoupling, progress) if found.requirements else ()
            told = spikes(analyses, found.requirements, kept)
            judged = decided(found.requirements, kept, [unclear(campaign, prepared, one) for one in found.requirements])
            said = conclusion(judged, found.judged_pointing)
            found = msgspec.structs.replace(found, warnings=(*told, *found.warnings), requirements=judged, verdict=said)

        def read(entry: RecordingEntry) -> Analysis:
            return _analyse(campaign, prepare(campaign, entry, decoupling, progress), model, progress)

        found = with_left_out(campaign, found, analyses, model, decoupling, read)
        with progress.task("Following the transducer's resonance") as task:
            on_transducer = study(campaign, analyses, model.rig, task.update)
        with progress.task("Following the orders of the joints"):
            by_angle = list(orders.study(campaign, analyses))
        by_instrument = list(instruments.study(campaign, analyses, model.rig))
        with progress.task("Writing the report"):
            write_tables(folder, analyses, on_transducer, by_angle, by_instrument)
            keep_diagnosis(campaign, target, folder)
            from kbs_process.studies.correlate.report import DOCUMENT  # draws: takes its time to import

            turned = tuple(one.findings for one in by_angle)
            found = msgspec.structs.replace(
                found,
                transducer=on_transducer and on_transducer.findings,
                orders=turned,
                instruments=tuple(row for one in by_instrument for row in one.findings()),
                warnings=(*found.warnings, *instruments.notices(by_instrument)),
            )
            serious = sum(notice.severity != "info" for notice in found.warnings)
            more = [f"Model: {found.model.status}. {found.model.sentence}"] if found.model else []
            more += [f"{count(serious, 'warning')}: see the top of the report"] if serious else []
            lossy = sum(bool(recording.lost) for recording in found.recordings)
            more += [f"{count(lossy, 'recording')} with losses"] if lossy else []
            outcome = publish(folder, target, found, DOCUMENT if page else None, pdf, *more)
            return replace(outcome, lossy=lossy > 0)


def _found(
    campaign: Campaign, prepared: Sequence[Prepared], decoupling: Decoupling, progress: Progress
) -> tuple[Results, Sequence[Analysis], GravityModel]:
    """Return what results.json holds, and what it was made from."""
    model = fit_gravity(campaign, prepared, progress)
    checked = check_model(campaign, prepared, model, progress)
    try:
        analyses = [_analyse(campaign, one, model, progress) for one in prepared]
    except SimulationError as error:
        for notice in checked.notices():
            if notice.severity == "error":  # which is why the plant has no solution
                raise SimulationError(f"{notice.what}; {error.what}", remedy=notice.remedy) from error
        raise
    with progress.task("Comparing, summing up uncertainties"):
        rungs = ladder(samples(campaign, prepared), model) if campaign.rig.transducer.channels else ()
        return summarise(campaign, analyses, model, decoupling, checked, rungs), analyses, model


def _with_spikes(
    campaign: Campaign, prepared: Sequence[Prepared], decoupling: Decoupling, progress: Progress
) -> tuple[Requirement, ...]:
    """Judge the requirements again, with the single samples that were interpolated: one of them may be a blow.

    None where nothing can be judged with them.
    """
    try:
        with_them = [
            prepare(campaign, one.entry, decoupling, progress, keep_spikes=True) if has_spikes(one.run) else one
            for one in prepared
        ]
        return _found(campaign, with_them, decoupling, progress)[0].requirements
    except (FitError, RecordingError):
        return ()


def _analyse(campaign: Campaign, one: Prepared, model: GravityModel, progress: Progress) -> Analysis:
    with progress.task(f"Analysing {one.entry.name}") as task:
        run = relieved(campaign, one.entry, one.run, one.motion)
        return analyse(campaign, one.entry, one.raw, run, one.motion, model, task.update)
