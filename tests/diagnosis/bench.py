"""An experiment made of the plant itself: EL089's rig on a short swing, repeated, with noise as its sensors state."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from archived import CAMPAIGNS, campaign
from kbs_process.diagnosis.experiments.experiment import Drive, Experiment, Trial
from kbs_process.diagnosis.experiments.floor import declared
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, predict
from kbs_process.diagnosis.experiments.metric import metrics
from kbs_process.diagnosis.nominal.joint import Standing
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.diagnosis.nominal.parameters import prior, slopes
from kbs_process.identification.output_error import Scalar
from kbs_process.plant.predict import Schedule
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array

CAMPAIGN = CAMPAIGNS / "EL089"
DT = 0.05
SECONDS = 12.0


def rig() -> Rig:
    """EL089's."""
    return campaign("EL089", recordings=False).rig


def unrounded(given: Rig) -> Rig:
    """The same with encoders of which nothing is stated."""
    return replace(given, joints=tuple(replace(joint, encoder=None) for joint in given.joints))


def effects() -> tuple[str, ...]:
    return campaign("EL089", recordings=False).effects


def schedule(seconds: float = SECONDS) -> Schedule:
    """Both joints swing from rest to rest, one after the other at different rates."""
    t = np.arange(0.0, seconds + 0.1, 0.1)
    rate = np.stack([0.02 * np.sin(2 * np.pi * t / 16.0), -0.012 * np.sin(2 * np.pi * t / 12.0)], axis=1)
    position = np.array([-0.1, 1.3]) + 0.1 * np.cumsum(rate, axis=0)
    return Schedule(t, position, rate, field=100.0 * position)


def noise(rng: np.random.Generator, n: int, c: int) -> Array:
    """White noise as EL089's transducer states it at 100 Hz, at the working rate; encoders to their code's tenth."""
    level = np.array([0.02] * 3 + [0.002] * 3 + [3.8e-5] * (c - 6))
    return np.asarray(level * np.sqrt(20.0 / 100.0) * rng.standard_normal((n, c)))


def experiment(
    truth: Rig,
    roles: tuple[str, ...],
    seed: int,
    seconds: float = SECONDS,
    *,
    bare_encoders: bool = False,
    path: Callable[[float], Schedule] = schedule,
) -> Experiment:
    """Trials of one trajectory with `truth` for hardware, biases and noise of their own; encoders do not round."""
    nominal = unrounded(rig()) if bare_encoders else rig()
    n = round(seconds / DT)
    channels = (*nominal.transducer.channels, *nominal.joint_names)
    units = ("N",) * 3 + ("N m",) * 3 + ("rad",) * 2
    drive = Drive(0, n, path(seconds), None, 100.0, 100.0)
    bare = Experiment(nominal, effects(), DT, channels, units, (drive,), (), 8.0)
    exact = predict(Hypothesis(truth, effects()), bare, 0).values
    rng = np.random.default_rng(seed)
    valid = np.ones(n, dtype=np.bool_)
    valid[:10] = valid[-10:] = False
    trials = []
    for number, role in enumerate(roles):
        bias = np.concatenate([rng.standard_normal(6), np.zeros(2)])
        measured = (exact + bias + noise(rng, n, 8)) * valid[:, None]
        trials.append(
            Trial(f"r{number}", role, 0, 0, measured, valid, 100.0, 100.0, 5e-5, 5e-5, None)  # type: ignore[arg-type]
        )
    return replace(bare, trials=tuple(trials))


def serial(made: Experiment):  # type: ignore[no-untyped-def]
    return lambda tasks: [predict(hypothesis, made, drive) for drive, hypothesis in tasks]


def standing(made: Experiment, free: tuple[Scalar, ...]) -> Standing:
    """The files' numbers, with the slopes of a few."""
    hypothesis, simulate = Hypothesis(made.rig, made.effects), serial(made)
    predicted = {0: predict(hypothesis, made, 0)}
    parameters = prior(made.rig, made.rig, made.effects, free)
    metric = metrics(made, declared(made), predicted)
    known = Known(
        experiment=made,
        hypothesis=hypothesis,
        free=free,
        parameters=parameters,
        scale=np.abs(hypothesis.values(free)),
        value=hypothesis.values(free),
        covariance=np.diag(parameters.sigma**2),
        metric=metric,
        slopes=slopes(made, hypothesis, free, 0.1 * parameters.sigma, [0], simulate),
        shown=predicted,
        residual=tuple(m(t.measured - predicted[0].values) for m, t in zip(metric, made.trials, strict=True)),
        chi2_before=np.zeros(len(made.trials)),
        checks=(),
    )
    return Standing(known, predicted, {})
