"""A diagnosis at the end of processing, where prediction and recordings differ by more than repeats do."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.floor import Floor
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis
from kbs_process.diagnosis.experiments.thresholds import DETECTED
from kbs_process.diagnosis.nominal.detection import Detection, detect
from kbs_process.diagnosis.selection.explain import floor_of, predicted_by
from kbs_process.progress import Progress
from kbs_process.results.diagnosed import FOLDER
from kbs_process.results.store import revising
from kbs_process.studies.diagnose.reading import experiment_of
from kbs_process.studies.diagnose.run import diagnose
from kbs_process.studies.diagnose.simulators import simulating


def diagnose_results(
    campaign: Campaign,
    results: Path,
    *,
    render: Callable[[Path, bool | None], object],
    progress: Progress,
    pdf: bool | None = None,
) -> tuple[str, ...]:
    """Diagnose what `results` were processed from if the floor is exceeded, into a folder of theirs; tell of it.

    `render` writes the page of the results anew, which then has the answer.

    Without a mismatch this costs a reading and a simulation of each recording. The results stay as they are until the
    diagnosis is done, and whatever becomes of it.
    """
    experiment = experiment_of(campaign, progress)
    with progress.task("Is the repeatability exceeded?"):
        noise, found = _detected(experiment)
    told = [f"Repeatability: {noise.statement}."] if noise.source == "declared" else []
    ratio = f"{np.sqrt(max(found.ratio, 0.0)):.3g} times the repeatability (rms)"
    if found.log_p > np.log(DETECTED):
        return (*told, f"Prediction and recordings differ by {ratio}: there is nothing to diagnose.")
    with revising(results, without=(FOLDER, "index.html", "report.pdf")) as folder:
        outcome = diagnose(campaign, folder / FOLDER, progress=progress, pdf=pdf, experiment=experiment, verb="")
        render(folder, pdf)
    return (
        *told,
        f"With the parameter files' numbers, prediction and recordings differ by {ratio}, all together.",
        f"With nominal parameters refitted within their uncertainties: {outcome.verdict_lines[0]}",
        f"Diagnosis: {results / FOLDER / outcome.report.name}",
    )


def _detected(experiment: Experiment) -> tuple[Floor, Detection]:
    """The floor, and what the parameter files' numbers leave beyond it."""
    with simulating(experiment) as simulate:
        predicted = predicted_by(experiment, Hypothesis(experiment.rig, experiment.effects), simulate)
    noise = floor_of(experiment, predicted)
    return noise, detect(experiment, noise, predicted, range(len(experiment.trials)))
