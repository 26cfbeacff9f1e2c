"""Identify a campaign's motor-gears: from its recordings to parameter files, held-out predictions and a report."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.errors import ConfigError
from kbs_process.identification import estimate as identification
from kbs_process.identification.estimate import Identification, Settings
from kbs_process.identification.output_error import Experiment, Measured, sensor_spectra, unexplained
from kbs_process.identification.unknowns import gearbox
from kbs_process.progress import Progress
from kbs_process.reduction.reading import read_run
from kbs_process.results.outcome import Outcome
from kbs_process.results.parallel import Crew
from kbs_process.studies.identify.evaluation import evaluator
from kbs_process.studies.identify.files import write_identification
from kbs_process.studies.identify.findings import Outcomes, Prediction
from kbs_process.studies.identify.measured import measured

_HIGHEST_RATE = 200.0  # Hz; what lies above 80 Hz the amplifiers of such transducers have taken off


def identify(
    campaign: Campaign,
    target: Path,
    *,
    settings: Settings,
    progress: Progress,
    pdf: bool | None = None,
    processes: int | None = None,
    scheduler: str | None = None,
) -> Outcome:
    """Identify over the recordings with the role "fit", predict those held out, and write the results to `target`."""
    if campaign.drive == "motion":
        raise ConfigError(
            "this campaign is driven by measured motion: there is no motor-gear to identify", where=campaign.name
        )
    fitted = _read(campaign, "fit", progress)
    if not fitted:
        raise ConfigError("no recording has the role 'fit'", where=campaign.name, remedy="give one that role")
    held_out = _read(campaign, "held-out", progress)
    base = Experiment(
        campaign.rig, campaign.effects, gearbox(campaign.rig, campaign.effects), fitted, settings.lowest_Hz
    )

    @contextmanager
    def say(what: str) -> Iterator[None]:
        with progress.task(what):
            yield

    with Crew(fitted, processes, scheduler) as crew:
        evaluate_with = partial(evaluator, crew)
        found = identification.identify(base, evaluate_with, settings, say)
        with progress.task("Profile likelihood"):
            profiles = identification.intervals(found, evaluate_with)
    with progress.task("Predicting held-out recordings"):
        predictions = (
            *(_predicted(found, recording, "held-out") for recording in held_out),
            *(_predicted(found, recording, "fit") for recording in fitted),
        )
    with progress.task("Writing the report"):
        return write_identification(campaign, Outcomes(found, settings, profiles, predictions), target, pdf)


def _read(campaign: Campaign, role: str, progress: Progress) -> tuple[Measured, ...]:
    """Recordings at the wrench's own rate: motors and gears put their signs high above the bands of interest."""
    found = []
    for entry in campaign.recordings:
        if entry.role == role:
            with progress.task(f"Reading {entry.name}"):
                slow = read_run(campaign, entry)
                full = replace(campaign.bands, working_rate=float(np.rint(min(slow.rates["wrench"], _HIGHEST_RATE))))
                found.append(measured(read_run(replace(campaign, bands=full), entry), campaign.rig))
    return tuple(found)


def _predicted(found: Identification, recording: Measured, role: Literal["fit", "held-out"]) -> Prediction:
    experiment = replace(found.experiment, recordings=(recording,))
    sensor = sensor_spectra(experiment, recording)
    before, after = (
        unexplained(experiment, recording, values, sensor) for values in (experiment.nominal, found.values)
    )
    return Prediction(recording, role, sensor, before, after)
