"""From a campaign's folder to what rivals are given: read, floor from repeats, known parameters refitted, residuals."""

from __future__ import annotations

import itertools
from pathlib import Path
from time import monotonic

import numpy as np

from kbs_process.campaign.load import load_campaign
from kbs_process.diagnosis.experiments.experiment import Experiment, Trial
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, Tapped, tapped
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.diagnosis.selection.explain import fitted_alone
from kbs_process.progress import SilentProgress
from kbs_process.signals.records import WRENCH_CHANNELS
from kbs_process.studies.diagnose.reading import experiment_of
from kbs_process.studies.diagnose.simulators import simulating
from proof.answer import Moved
from proof.rivals.case import Array, Case, Recording

_SIGNALS = ("rotor_angle", "rotor_rate", "joint_angle", "joint_rate")
_MOVED = 4.0  # sigmas


def prepare(folder: Path) -> Case:
    """Do for a campaign what the diagnosis does before it looks for physics."""
    begin = monotonic()
    experiment = experiment_of(load_campaign(folder, checksums=False), SilentProgress())
    with simulating(experiment) as simulate:
        explained = fitted_alone(experiment, simulate, SilentProgress().task)
    found, predicted = explained.known, explained.known.shown
    signals = {drive: _signals(experiment, found.hypothesis, drive, seen.wrench) for drive, seen in predicted.items()}
    left = [trial.measured - predicted[trial.drive].values for trial in experiment.trials]
    unit = _repeatability(experiment, left)
    angles = experiment.channels[experiment.wrench_channels :]
    recordings = tuple(
        _recording(trial, experiment.dt, residual / unit, signals[trial.drive], found, k, unit)
        for k, (trial, residual) in enumerate(zip(experiment.trials, left, strict=True))
    )
    moved = tuple(
        Moved(name=name, value=float(value), sigma=float(sigma), sigmas=float(by))
        for name, value, sigma, by in zip(found.names, found.value, found.sigma, found.moved, strict=True)
        if abs(by) > _MOVED
    )
    return Case(
        trial=folder.name,
        channels=(*experiment.channels[: experiment.wrench_channels], *(f"angle.{name}" for name in angles)),
        joints=experiment.rig.joint_names,
        recordings=recordings,
        moved=moved,
        log10_p=explained.after.log10_p,
        seconds=monotonic() - begin,
    )


def _signals(experiment: Experiment, hypothesis: Hypothesis, drive: int, wrench: Array) -> dict[str, Array]:
    """The plant's signals at the working rate, each the mean over a working sample."""
    taps = tapped(hypothesis, experiment, drive)
    time = experiment.dt * np.arange(len(wrench), dtype=np.float64)
    found: dict[str, Array] = {"time": time}
    for joint in experiment.rig.joint_names:
        for name in _SIGNALS:
            found[f"{name}.{joint}"] = _averaged(taps, f"{name}.{joint}", time, experiment.dt)
    for channel in experiment.rig.transducer.channels:
        found[f"wrench.{channel}"] = wrench[:, WRENCH_CHANNELS.index(channel)]
    return found


def _averaged(taps: Tapped, column: str, time: Array, dt: float) -> Array:
    values = taps.values[:, taps.columns.index(column)]
    width = max(1, round(taps.rate * dt))
    mean = np.convolve(np.pad(values, width, mode="edge"), np.ones(width) / width, mode="same")[width:-width]
    return np.interp(time, np.arange(len(mean)) / taps.rate, mean)


def _repeatability(experiment: Experiment, left: list[Array]) -> Array:
    """Rms by which repeats differ, by channel, over sqrt 2; of residuals alone where nothing was repeated.

    No less than the rounding of codes: an encoder at rest repeats itself exactly.
    """
    apart = []
    for members in experiment.repeats:
        for one, other in itertools.pairwise(members):
            valid = experiment.trials[one].valid & experiment.trials[other].valid
            difference = (left[one] - left[other])[valid]
            apart.append((difference - difference.mean(axis=0)) / np.sqrt(2.0))
    rows = np.concatenate(apart or [r[t.valid] for r, t in zip(left, experiment.trials, strict=True)])
    transducer = experiment.rig.transducer
    codes = [float(transducer.resolution.value[WRENCH_CHANNELS.index(c)]) for c in transducer.channels]
    for joint in experiment.angle_joints:
        encoder = experiment.rig.joints[joint].encoder
        codes.append(float(encoder.step) if encoder else 0.0)
    least = np.maximum(np.array(codes) / np.sqrt(12.0), 1e-12)
    return np.asarray(np.maximum(np.sqrt(np.mean(rows**2, axis=0)), least), dtype=np.float64)


def _recording(
    trial: Trial, dt: float, residual: Array, signals: dict[str, Array], found: Known, index: int, unit: Array
) -> Recording:
    metric = found.metric[index]
    return Recording(
        name=trial.name,
        held_out=trial.role == "held-out",
        trajectory=trial.trajectory,
        dt=dt,
        valid=trial.valid,
        residual=residual,
        signals=signals,
        whiten=lambda x: metric(x * unit * trial.valid[:, None]),
    )
