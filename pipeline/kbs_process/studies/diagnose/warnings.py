"""What is to be known of the recordings that a diagnosis is of, and what to do about it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from kbs_process.campaign.config import Campaign, RecordingEntry
from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.floor import Floor
from kbs_process.diagnosis.selection.outcome import Outcome
from kbs_process.reduction.losses import lost
from kbs_process.results.records import Notice
from kbs_process.signals.records import Loss
from kbs_process.studies.diagnose.corrected import left_out
from kbs_process.studies.diagnose.stretch import PASSED_OVER
from kbs_process.studies.diagnose.terms import CORRECTED

_EACH_TIME = "it is each recording's own: the corrected model is without it"


def warnings(campaign: Campaign, floor: Floor, outcome: Outcome) -> Iterator[Notice]:
    """What a reader of the results has to know of the recordings that they are of."""
    experiment = outcome.standing.known.experiment
    for find in outcome.finds:
        if not find.gate.held_out:
            yield Notice(
                severity="warning",
                what=f"{find.identity.law} was judged by leaving out fit recordings in turn: none was held out",
                remedy="give a recording the role held-out, better of another trajectory",
            )
        if left_out(find):
            yield Notice(severity="info", what=f"{find.identity.law}: {_EACH_TIME}", where=CORRECTED)
    if not experiment.held_out:
        yield Notice(
            severity="warning",
            what="no recording is held out: nothing is shown on recordings that were not used",
            remedy='set role = "held-out" for a repeat or another trajectory',
        )
    if outcome.unforeseen:
        yield Notice(
            severity="warning",
            what="what recordings that were held out show, those that were fitted do not: nothing of it was looked for",
            remedy='give one of them the role "fit", and hold out another one that shows it',
        )
    elif outcome.finds and experiment.held_out and not _other_motions(experiment):
        yield Notice(
            severity="warning",
            what="recordings that were held out repeat motions that were fitted: a law that holds for these alone, or "
            "known parameters that were not found, would pass too",
            remedy="hold out a recording of another trajectory",
        )
    if outcome.ended and outcome.verdict != "none":
        yield Notice(
            severity="warning",
            what="the search was ended after as much work as it may cost: laws beside those that were tried were not",
            remedy="give what is known of the rig's parameters closer, or diagnose recordings that show one joint",
        )
    angle, command = campaign.topics.angle, campaign.topics.command
    if angle and command and angle.topic == command.topic and outcome.verdict != "none":
        yield Notice(
            severity="warning",
            what="the motion is the commanded one: what motors, gears and friction made of it shows in the loads, and "
            "no prediction has it",
            remedy="record the encoders, and name their topic under [topics]",
        )
    if floor.source == "declared":
        yield Notice(
            severity="warning",
            what=f"{floor.statement}: other noise would be taken for a mismatch, and one below that frequency alone is "
            "not detected",
            remedy="repeat a trajectory",
        )
    for entry in campaign.recordings:
        for trial in experiment.trials:
            if trial.name == entry.name:
                yield from lost(entry, [loss for loss in trial.losses if loss.kind != PASSED_OVER])
                yield from passed_over(entry, trial.losses)


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


def _other_motions(experiment: Experiment) -> bool:
    """Whether a trajectory was held out of which nothing was fitted."""
    fitted = {experiment.trials[k].trajectory for k in experiment.fit}
    return any(experiment.trials[k].trajectory not in fitted for k in experiment.held_out)
