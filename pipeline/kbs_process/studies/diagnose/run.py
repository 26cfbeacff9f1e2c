"""Diagnose a campaign: what its recordings hold beyond what repeats differ by, and what explains it."""

from __future__ import annotations

from pathlib import Path

from kbs_process.campaign.config import Campaign
from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.selection import rounds
from kbs_process.diagnosis.selection.explain import explain
from kbs_process.diagnosis.selection.next_test import propose
from kbs_process.progress import Progress
from kbs_process.results.outcome import Outcome
from kbs_process.studies.diagnose.output import write_diagnosis
from kbs_process.studies.diagnose.reading import experiment_of
from kbs_process.studies.diagnose.simulators import simulating


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
    with simulating(experiment) as simulate:
        explained = explain(experiment, simulate, progress.task)
        with progress.task("Candidate effects for the residual"):
            outcome = rounds.diagnose(
                explained.known,
                explained.floor,
                simulate,
                explained.after,
                explained.near,
                beside=explained.beside,
                smoothed=explained.smoothed,
            )
    with progress.task("Next test"):
        proposal = propose(outcome.standing, outcome.finds, explained.floor, simulating)
    with progress.task("Writing the report"):
        return write_diagnosis(campaign, explained.floor, outcome, target, pdf, proposal, verb)
