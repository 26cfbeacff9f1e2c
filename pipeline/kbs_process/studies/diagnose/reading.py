"""Read the recordings of a campaign as the experiment that a diagnosis is of.

It simulates every recording some hundred times and holds the slopes of a hundred numbers along it: of hours, neither
ends in a day nor fits into memory. Of a long recording it therefore takes the part that moves most, which says most.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from kbs_process.campaign.config import Campaign, RecordingEntry
from kbs_process.diagnosis.experiments.experiment import Experiment, Recorded, assemble
from kbs_process.errors import ConfigError, RecordingError
from kbs_process.plant.predict import Schedule
from kbs_process.progress import Progress
from kbs_process.reduction.held import read_alive
from kbs_process.reduction.predicting import AT_REST, LEAD, approached, commanded_from, schedule_of
from kbs_process.reduction.settings import motion_settings
from kbs_process.results.records import Notice
from kbs_process.signals.records import Events, Loss, Run
from kbs_process.stages import decouple, motion
from kbs_process.stages.motion import Motion
from kbs_process.stages.repeats import motion_of
from kbs_process.studies.diagnose.diagnosable import check_copies, check_length, check_noise, check_signs

LONGEST_S = 600.0
PASSED_OVER = "not looked at"  # kind of loss: readings outside that part
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


def read_stretch(campaign: Campaign, entry: RecordingEntry, progress: Progress) -> Run:
    """Read a recording without what its channels were held in, or the busiest `LONGEST_S` of one that is longer."""
    with progress.task(f"Reading {entry.name}"):
        run = read_alive(campaign, entry)
    span = busiest(run)
    if span is None:
        return run
    whole = _seconds(run)
    with progress.task(
        f"Reading {entry.name}: of its {whole:.0f} s the {LONGEST_S:.0f} s from {span[0]:.0f} s on, which move most"
    ):
        begin = entry.start or 0.0
        part = read_alive(campaign, replace(entry, start=begin + span[0], end=begin + span[1]))
    told = f"of its {whole:.0f} s only those from {begin + span[0]:.0f} s to {begin + span[1]:.0f} s, which move most"
    left = Loss(PASSED_OVER, "wrench", round((whole - LONGEST_S) * run.load_rates[0]), detail=told)
    return replace(part, losses=(*part.losses, left))


def busiest(run: Run) -> tuple[float, float] | None:
    """Span, s, of the `LONGEST_S` along which joints go farthest, from rest if possible; None of a short run."""
    moved = motion_of(run)
    if moved is None or _seconds(run) <= LONGEST_S:
        return None
    steps = np.abs(np.diff(moved.values, axis=0))
    way = np.concatenate([[0.0], np.cumsum(steps.sum(axis=1))])
    count = round(LONGEST_S / moved.dt)
    gone = way[count:] - way[:-count]
    rests = steps[: len(gone)].max(axis=1) < AT_REST * moved.dt
    gone = gone[: len(rests)]
    start = int(np.argmax(np.where(rests, gone, -1.0) if rests.any() else gone)) * moved.dt + moved.t0
    return start, start + LONGEST_S


def _seconds(run: Run) -> float:
    return 0.0 if run.loads is None else len(run.loads) * run.loads.dt


def passed_over(entry: RecordingEntry, losses: Sequence[Loss]) -> Iterator[Notice]:
    """Which part of a long recording all this is of."""
    for loss in losses:
        if loss.kind == PASSED_OVER:
            yield Notice(
                severity="warning",
                what=f"looked at is {loss.detail}",
                where=entry.name,
                remedy="give its start_s and end_s in campaign.toml to look at another part",
            )
