"""One prediction at a time: from commands before a test, or of one recording after it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np

from kbs_process.campaign.config import Campaign, RecordingEntry
from kbs_process.errors import ConfigError, did_you_mean
from kbs_process.plant.laws import select
from kbs_process.plant.moved import added_loads
from kbs_process.plant.predict import Schedule, predict
from kbs_process.plant.rigid import loads
from kbs_process.plant.schedule import stopped
from kbs_process.progress import Progress
from kbs_process.reduction.commands import of_table, of_trajectory
from kbs_process.reduction.predicting import approached, schedule_of
from kbs_process.reduction.reading import read_run
from kbs_process.reduction.reading_laws import read_through
from kbs_process.reduction.settings import motion_settings
from kbs_process.signals.records import Block, Run
from kbs_process.stages.motion import estimate
from kbs_process.studies.predict.files import write_prediction

TABLES = (".csv", ".parquet")  # of commands, by the file's name


def simulate_commands(
    campaign: Campaign, commands: Path, target: Path, *, rate_Hz: float, progress: Progress, stop: float
) -> Path:
    """Simulate the commands of a CSV or Parquet file through the controller; return `target`."""
    _require_commands(campaign)
    given = of_table(commands, campaign.rig)
    with progress.task(f"Simulating {given.told}") as task:
        streams = predict(
            campaign.rig,
            campaign.effects,
            stopped(given.schedule, campaign.rig.controller, stop),
            rate_Hz=rate_Hz,
            angle_rate_Hz=rate_Hz,
            duration_s=float(given.schedule.t[-1]),
            progress=task.update,
        )
        return write_prediction(campaign, streams, target, "simulated", given.name, (commands,))


def simulate_trajectory(
    campaign: Campaign, trajectory: str | None, target: Path, *, rate_Hz: float | None, progress: Progress, stop: float
) -> Path:
    """Simulate the commands recorded in a trajectory's first run (default: the last one listed)."""
    _require_commands(campaign)
    given = of_trajectory(campaign, trajectory, progress)
    run = given.run
    assert run is not None  # a recording's
    with progress.task(f"Simulating {given.told}") as task:
        path = stopped(given.schedule, campaign.rig.controller, stop)
        streams = _as_recorded(campaign, campaign.effects, path, run, task.update, rate_Hz)
        return write_prediction(
            campaign, streams, target, "simulated", given.name, (given.source,), epoch_ns=run.epoch_ns
        )


def predict_recording(campaign: Campaign, recording: str, target: Path, *, progress: Progress) -> Path:
    """Predict one recording, driven by whatever was recorded of it; return `target`.

    `recording` is a name of the campaign's, or any other file with its topics. The model's laws of sensors act on it.
    """
    entry = _entry(campaign, recording)
    with progress.task(f"Reading {entry.name}"):
        run = read_run(campaign, entry)
    with progress.task(f"Predicting {entry.name}") as task:
        effects = campaign.acting(entry)
        if campaign.drive == "motion":
            streams = _motion_driven(campaign, effects, run)
        else:
            schedule = approached(schedule_of(run, campaign.rig))
            streams = _as_recorded(campaign, effects, schedule, run, task.update)
        read = read_through(campaign, streams, run.temperature)
        return write_prediction(campaign, read, target, "predicted", entry.name, (entry.path,), epoch_ns=run.epoch_ns)


def predict_with(model: Campaign, recording: str, target: Path, *, rate_Hz: float = 100.0, progress: Progress) -> Path:
    """Predict a recording, or commands of a CSV or Parquet file, with a model; return `target`."""
    path = Path(recording)
    if path.suffix.lower() in TABLES and path.exists():
        return simulate_commands(model, path, target, rate_Hz=rate_Hz, progress=progress, stop=np.inf)
    return predict_recording(model, recording, target, progress=progress)


def _motion_driven(campaign: Campaign, effects: Sequence[str], run: Run) -> Iterable[tuple[str, Block]]:
    """Yield what the measured motion asks of the instruments, at the working rate."""
    rig = campaign.rig
    motion = estimate(run, rig, motion_settings(campaign))
    stamp = np.rint((motion.t0 + motion.dt * np.arange(len(motion))) * 1e9).astype(np.int64)
    values = loads(rig, motion.q, motion.qd, motion.qdd)
    values = values + added_loads(rig, select(effects), motion.q, motion.qd, motion.dt)
    if rig.transducer.channels:
        yield "wrench", Block(stamp, stamp, values[:, :6])
    if any(joint.effort is not None for joint in rig.joints):
        # A message of joints has their angles and rates before their efforts.
        yield "effort", Block(stamp, stamp, np.hstack([motion.q, motion.qd, values[:, 6:]]))
    yield "angle", Block(stamp, stamp, motion.q + motion.offset)


def _as_recorded(
    campaign: Campaign,
    effects: Sequence[str],
    schedule: Schedule,
    run: Run,
    update: Callable[[float], None],
    rate_Hz: float | None = None,
) -> Iterable[tuple[str, Block]]:
    """Return what the plant does on commands, sampled as a run was (the wrench at `rate_Hz`), and for as long."""
    wrench = run.rates["wrench"]
    return predict(
        campaign.rig,
        effects,
        schedule,
        rate_Hz=rate_Hz or wrench,
        angle_rate_Hz=run.rates.get("angle", wrench),
        duration_s=max(float(one.t0 + len(one) * one.dt) for one in (run.wrench, run.angle) if one is not None),
        progress=update,
    )


def _require_commands(campaign: Campaign) -> None:
    if campaign.drive == "motion":
        raise ConfigError(
            "this campaign is driven by measured motion: commands move nothing",
            where=campaign.name,
            remedy="use 'predict' with a recording",
        )


def _entry(campaign: Campaign, recording: str) -> RecordingEntry:
    """Return the campaign's recording of that name, or one for any other file."""
    names = [entry.name for entry in campaign.recordings]
    if recording in names:
        return campaign.recording(recording)
    path = Path(recording)
    if path.exists():
        return RecordingEntry(path.stem, path.absolute(), path.stem, "held-out", 1, None, None, None)
    raise ConfigError(
        f"there is no recording '{recording}', and no such file",
        where=campaign.name,
        remedy=did_you_mean(recording, names),
    )
