"""Diagnose a campaign: what its recordings hold beyond what repeats differ by, and what explains it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from kbs_process.campaign.config import Campaign, RecordingEntry
from kbs_process.diagnosis.experiments.experiment import Experiment, Recorded, assemble
from kbs_process.diagnosis.nominal.explain import explain
from kbs_process.diagnosis.selection import rounds
from kbs_process.errors import ConfigError, RecordingError
from kbs_process.plant.predict import Schedule
from kbs_process.progress import Progress
from kbs_process.reduction.predicting import AT_REST, LEAD, approached, commanded_from, schedule_of
from kbs_process.reduction.settings import motion_settings
from kbs_process.results.outcome import Outcome
from kbs_process.signals.records import Events, Run
from kbs_process.stages import decouple, motion
from kbs_process.stages.motion import Motion
from kbs_process.studies.diagnose.diagnosable import check_copies, check_length, check_noise, check_signs
from kbs_process.studies.diagnose.files import write_diagnosis
from kbs_process.studies.diagnose.next_test import proposed
from kbs_process.studies.diagnose.simulators import Simulators
from kbs_process.studies.diagnose.stretch import read_stretch

_CYCLES = 1.5  # between two commands, from which on one is missing


def experiment_of(campaign: Campaign, progress: Progress) -> Experiment:
    """Read all recordings of a campaign and lay repeats on one grid."""
    check_noise(campaign.rig, campaign.name)
    decoupling = decouple.fit(campaign.rig)
    runs = []
    for entry in campaign.recordings:
        run = decouple.apply(read_stretch(campaign, entry, progress), decoupling)
        if run.loads is None:
            raise RecordingError("there is neither wrench nor effort", where=str(entry.path))
        moved = motion.estimate(run, campaign.rig, motion_settings(campaign))
        check_signs(run, moved, campaign, entry)
        runs.append((entry, run, moved))
    check_copies([(entry, run) for entry, run, _ in runs])
    with progress.task("Laying repeats on one grid"):
        experiment = assembled(campaign, runs)
        for entry, trial in zip(campaign.recordings, experiment.trials, strict=True):
            check_length(trial.name, trial.valid, experiment.dt, str(entry.path))
    return experiment


def assembled(campaign: Campaign, runs: Sequence[tuple[RecordingEntry, Run, Motion]]) -> Experiment:
    """The experiment of recordings that are decoupled and whose joints' motion is known."""
    if not any(entry.role != "held-out" for entry, _, _ in runs):
        raise ConfigError("every recording is held out: there is nothing to fit", where=campaign.name)
    recorded = [_recorded(campaign, entry, run, moved) for entry, run, moved in runs]
    highest = motion_settings(campaign).band_Hz if campaign.drive == "motion" else None
    return assemble(recorded, campaign.rig, campaign.effects, highest_Hz=highest)


def _recorded(campaign: Campaign, entry: RecordingEntry, run: Run, moved: Motion) -> Recorded:
    absent = tuple(name for name in campaign.effects if name not in campaign.acting(entry))
    if campaign.drive == "motion":
        return Recorded(entry.role, entry.trajectory, run, None, moved, absent=absent)
    schedule = schedule_of(run, campaign.rig)
    span = commanded_from(run), _commanded_until(schedule)
    return Recorded(
        entry.role,
        entry.trajectory,
        run,
        approached(schedule),
        None,
        *span,
        unknown=(*_gaps(run.command), *_gaps(run.field)),
        absent=absent,
    )


def _commanded_until(schedule: Schedule) -> float:
    """Return the time, s, after which nobody recorded what moved the joints: of the last command, if they moved."""
    steps, cycles = np.diff(schedule.position[-2:], axis=0), np.diff(schedule.t[-2:])
    moves = len(cycles) > 0 and np.abs(steps).max() > AT_REST * cycles[0]
    return float(schedule.t[-1]) if moves else float("inf")


def _gaps(events: Events | None) -> Iterator[tuple[float, float]]:
    """Yield spans in which nobody recorded what moved the joints, and in which the article rings from a guess of it."""
    if events is None or len(events.t) < 2:
        return
    steps = np.diff(events.t)
    moved = np.abs(np.diff(events.values, axis=0)).max(axis=1)
    for index in np.flatnonzero((steps > _CYCLES * np.median(steps)) & (moved > AT_REST * steps)):
        yield float(events.t[index]), float(events.t[index + 1]) + LEAD


def diagnose(
    campaign: Campaign,
    target: Path,
    *,
    progress: Progress,
    pdf: bool | None = None,
    experiment: Experiment | None = None,
    verb: str = "diagnose",
) -> Outcome:
    """Diagnose a campaign and write the answers to `target`; `experiment` is that of its recordings, if it is there.

    `verb` is that of the command that was given, none of processing: the results name the command.
    """
    experiment = experiment or experiment_of(campaign, progress)
    with Simulators(experiment) as simulate:
        explained = explain(experiment, simulate, progress.task)
        with progress.task("Suspects: what the known parameters leave"):
            outcome = rounds.diagnose(
                explained.known, explained.floor, simulate, explained.after, explained.near, beside=explained.beside
            )
    with progress.task("Next test"):
        proposal = proposed(outcome, explained.floor)
    with progress.task("Writing the report"):
        return write_diagnosis(campaign, explained.floor, outcome, target, pdf, proposal, verb)
