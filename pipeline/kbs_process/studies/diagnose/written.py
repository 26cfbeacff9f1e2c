"""What the corrected model predicts of each recording: read from its folder again, as anybody reads it who gets it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.campaign.load import load_campaign
from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, Prediction
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.diagnosis.selection.explain import predicted_by
from kbs_process.reduction.reading_laws import readings
from kbs_process.signals.records import Array, Signal
from kbs_process.studies.diagnose.simulators import simulating


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """A model's predictions of all recordings, and what they leave."""

    known: Known  # its residuals are what they leave
    values: tuple[Array, ...]  # of each trial, (n, c)


def shown_by(folder: Path, known: Known) -> Shown:
    """Return what the model in a folder predicts of the recordings that `known` is of, judged as this is."""
    model, experiment = load_campaign(folder), known.experiment
    with simulating(experiment) as simulate:
        predicted = predicted_by(experiment, Hypothesis(model.rig, model.effects), simulate)
    values = tuple(_read(model, experiment, k, predicted[trial.drive]) for k, trial in enumerate(experiment.trials))
    left = tuple(
        metric(trial.measured - own) for metric, trial, own in zip(known.metric, experiment.trials, values, strict=True)
    )
    return Shown(replace(known, residual=left), values)


def _read(model: Campaign, experiment: Experiment, k: int, prediction: Prediction) -> Array:
    """(n, c) what the model's sensors make of a prediction of trial `k`."""
    trial, whole = experiment.trials[k], prediction.values
    t: Array = experiment.dt * np.arange(len(whole), dtype=np.float64)
    temperature = None
    if trial.temperature is not None:
        warmth = trial.temperature[:, None]
        temperature = Signal(0.0, experiment.dt, warmth, ("temperature",), ("degC",), "", np.full(len(t), True))
    parts = (("wrench", slice(0, experiment.loads)), ("angle", slice(experiment.loads, len(experiment.channels))))
    read = [
        readings(model.sensing, key, experiment.channels[own], t, whole[:, own], model.rig, temperature)
        for key, own in parts
    ]
    return np.hstack(read)
