"""Diagnose a campaign: what its recordings hold beyond what repeats differ by, and what explains it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from kbs_process.campaign.config import Campaign, RecordingEntry
from kbs_process.campaign.diagnosis_files import write_diagnosis
from kbs_process.campaign.next_test import proposed
from kbs_process.campaign.predicting import approached, commanded_from, schedule_of
from kbs_process.campaign.progress import Progress
from kbs_process.campaign.reading import read_run
from kbs_process.campaign.run import Outcome
from kbs_process.campaign.settings import motion_settings
from kbs_process.campaign.simulators import Simulators
from kbs_process.diagnosis import detection, floor, phasing, rounds
from kbs_process.diagnosis.detection import Detection
from kbs_process.diagnosis.experiment import Experiment, Recorded, assemble
from kbs_process.diagnosis.explain import explained
from kbs_process.diagnosis.floor import Floor
from kbs_process.diagnosis.hypothesis import Hypothesis, Prediction, Simulate
from kbs_process.diagnosis.known import Known
from kbs_process.errors import ConfigError, RecordingError
from kbs_process.signals.records import Run
from kbs_process.stages import decouple, motion
from kbs_process.stages.motion import Motion

_REFITS = 1  # of the floor, where repeats were not driven alike


@dataclass(frozen=True, slots=True, eq=False)
class Explained:
    """How far the known parameters get, and what they leave."""

    experiment: Experiment
    floor: Floor
    known: Known
    predicted: dict[int, Prediction]  # by drive, with the refitted numbers
    before: Detection  # with the parameter files' numbers
    after: Detection  # with the refitted ones, over the recordings that these were fitted to
    held_out: Detection | None  # likewise over the others


def experiment_of(campaign: Campaign, progress: Progress) -> Experiment:
    """Read all recordings of a campaign and lay repeats on one grid."""
    decoupling = decouple.fit(campaign.rig)
    runs = []
    for entry in campaign.recordings:
        with progress.task(f"Reading {entry.name}"):
            run = decouple.apply(read_run(campaign, entry), decoupling)
            if run.loads is None:
                raise RecordingError("there is neither wrench nor effort", where=str(entry.path))
            runs.append((entry, run, motion.estimate(run, campaign.rig, motion_settings(campaign))))
    with progress.task("Laying repeats on one grid"):
        return assembled(campaign, runs)


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
    schedule = approached(schedule_of(run, campaign.rig))
    return Recorded(entry.role, entry.trajectory, run, schedule, None, commanded_from(run), absent)


def diagnose(
    campaign: Campaign,
    target: Path,
    *,
    progress: Progress,
    pdf: bool | None = None,
    experiment: Experiment | None = None,
) -> Outcome:
    """Diagnose a campaign and write the answers to `target`; `experiment` is that of its recordings, if it is there."""
    experiment = experiment or experiment_of(campaign, progress)
    with Simulators(experiment) as simulate:
        explained = explain(experiment, simulate, progress)
        with progress.task("Suspects: what the known parameters leave"):
            outcome = rounds.diagnose(
                explained.known, explained.floor, explained.predicted, simulate, explained.after
            )
    with progress.task("Next test"):
        proposal = proposed(outcome, explained.floor)
    with progress.task("Writing the report"):
        return write_diagnosis(
            campaign, explained.floor, explained.known, explained.predicted, outcome, target, pdf, proposal
        )


def explain(experiment: Experiment, simulate: Simulate, progress: Progress) -> Explained:
    """Floor, detection, refit of the known parameters, detection of what they leave."""
    nominal = Hypothesis(experiment.rig, experiment.effects)
    with progress.task("Repeatability floor, and what exceeds it"):
        predicted = _predicted(experiment, nominal, simulate)
        noise = _floor(experiment, predicted)
        before = detection.detect(experiment, noise, predicted, experiment.fit)
    with progress.task("Phases of cogging, friction and tooth contact"):
        (start,) = phasing.begin(experiment, nominal, noise, simulate)
    with progress.task("Refitting the known parameters"):
        found, predicted, after = explained(experiment, start, noise, simulate)
        for _ in range(0 if _driven_alike(experiment) else _REFITS):
            noise = _floor(experiment, predicted)
            found, predicted, after = explained(
                experiment, found.hypothesis, noise, simulate, slopes=found.slopes
            )
    with progress.task("What the known parameters leave"):
        held_out = (
            detection.detect(experiment, noise, predicted, experiment.held_out, known=found)
            if experiment.held_out
            else None
        )
    return Explained(experiment, noise, found, predicted, before, after, held_out)


def _driven_alike(experiment: Experiment) -> bool:
    return all(len({experiment.trials[k].drive for k in members}) == 1 for members in experiment.repeats)


def _predicted(experiment: Experiment, hypothesis: Hypothesis, simulate: Simulate) -> dict[int, Prediction]:
    return dict(enumerate(simulate([(drive, hypothesis) for drive in range(len(experiment.drives))])))


def _floor(experiment: Experiment, predicted: dict[int, Prediction]) -> Floor:
    left = {k: t.measured - predicted[t.drive].values for k, t in enumerate(experiment.trials)}
    return floor.estimate(experiment, left)
