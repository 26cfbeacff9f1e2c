"""What rings at the beginning of a recording is taken out of it, and nothing else is."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis import bench
from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.floor import declared
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, predict
from kbs_process.diagnosis.experiments.metric import metrics
from kbs_process.diagnosis.experiments.nuisance import decays
from kbs_process.plant.laws import select
from kbs_process.plant.linear.modes import modes
from kbs_process.rig.model import substitute
from kbs_process.signals.records import Array

pytestmark = pytest.mark.slow

BEGIN = 10


@pytest.fixture(scope="module")
def made() -> Experiment:
    return bench.experiment(bench.rig(), ("fit",), seed=3)


@pytest.fixture(scope="module")
def columns(made: Experiment) -> Array:
    return decays(made, Hypothesis(made.rig, made.effects), 0, BEGIN, made.drives[0].n)


def test_decays_have_the_frequencies_of_the_modes(made: Experiment, columns: Array) -> None:
    schedule = made.drives[0].schedule
    assert schedule is not None
    known = [mode.frequency for mode in modes(made.rig, select(made.effects), schedule.position[0])]
    spectrum = np.abs(np.fft.rfft(columns[BEGIN:, 3:6].reshape(len(columns) - BEGIN, -1), axis=0)).max(axis=1)
    f = np.fft.rfftfreq(len(columns) - BEGIN, made.dt)
    assert np.min(np.abs(f[np.argmax(spectrum)] - known)) < 2.0 * f[1]


def test_they_begin_where_the_recording_does_and_die_away(columns: Array) -> None:
    energy = np.sum(columns**2, axis=(1, 2))
    third = (len(columns) - BEGIN) // 3
    assert not energy[:BEGIN].any()
    assert energy[-third:].sum() < 0.5 * energy[BEGIN : BEGIN + third].sum()


def test_ringing_is_no_mismatch_but_a_tone_in_the_middle_is(made: Experiment, columns: Array) -> None:
    hypothesis = Hypothesis(made.rig, made.effects)
    predicted = {0: predict(hypothesis, made, 0)}
    metric = metrics(made, declared(made), predicted, hypothesis)[0]
    valid = made.trials[0].valid[:, None]
    rings = columns @ np.array([1e-4, -2e-4, 1e-4, 1e-3, 2e-3, -1e-3]) * valid
    rings *= 0.05 / np.abs(rings[:, 3:6]).max()
    late = np.roll(rings, len(rings) // 2, axis=0)
    late[: len(rings) // 2] = 0.0
    plain = float(np.sum(metric.whiten(rings) ** 2))
    assert plain > 1e3
    assert float(np.sum(metric(rings) ** 2)) < 0.02 * plain
    assert float(np.sum(metric(late) ** 2)) > 0.2 * float(np.sum(metric.whiten(late) ** 2))


def test_what_runs_away_is_no_decay(made: Experiment) -> None:
    """A base too soft for the weight that it carries topples: what grows has overflown before the end."""
    soft = substitute(made.rig, {"transducer.stiffness": np.full(3, 1e-3)})
    n = made.drives[0].n
    assert decays(made, Hypothesis(soft, made.effects), 0, BEGIN, n).shape == (n, len(made.channels), 0)
