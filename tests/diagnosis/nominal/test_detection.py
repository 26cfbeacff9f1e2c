"""P-values of the detection: uniform for noise, small for what is really there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from diagnosis.experiments.test_floor import CHANNELS, N, made
from kbs_process.diagnosis.experiments import floor
from kbs_process.diagnosis.experiments.experiment import Experiment, Trial
from kbs_process.diagnosis.experiments.hypothesis import Prediction
from kbs_process.diagnosis.experiments.whiten import window_of
from kbs_process.diagnosis.nominal.detection import Cell, Detection, detect
from kbs_process.signals.records import Array, Mask

pytestmark = pytest.mark.slow

NOTHING = {0: Prediction(np.zeros((N, CHANNELS)), np.zeros((N, 6)))}


def detected(experiment: Experiment) -> Detection:
    left = {k: trial.measured for k, trial in enumerate(experiment.trials)}
    return detect(experiment, floor.estimate(experiment, left), NOTHING, tuple(left))


def test_noise_alone_gives_uniform_p_values() -> None:
    """Few repeats, so that chi-square would reject far too often."""
    p = []
    for seed in range(8):
        cells = detected(made(seed, 3, np.zeros((N, CHANNELS)))).cells
        p += [float(np.exp(cell.log_p)) for cell in cells]
    assert len(p) > 100
    # binomial: 5 % of some 110 are 5.6 +- 2.3
    assert 0.0 <= np.mean(np.array(p) < 0.05) < 0.13
    assert 0.35 < np.mean(p) < 0.65


def test_a_mismatch_of_the_size_of_the_noise_is_detected_where_it_is() -> None:
    t = bench.DT * np.arange(N)
    tone: Array = np.zeros((N, CHANNELS))
    tone[:, 3] = 6e-4 * np.sin(2.0 * np.pi * 1.5 * t)
    found = detected(made(3, 3, tone))
    assert found.log10_p < -6.0
    worst = min(found.cells, key=_log_p)
    assert worst.low_Hz < 1.5 <= worst.high_Hz


def test_what_repeats_differ_by_is_no_detection() -> None:
    """A disturbance of one repeat alone belongs to the floor, and the mean residual has its share of it."""
    experiment = made(4, 3, np.zeros((N, CHANNELS)))
    rng = np.random.default_rng(9)
    burst = 3e-2 * rng.standard_normal((N, CHANNELS))
    first = experiment.trials[0]
    changed = replace(first, measured=first.measured + burst * first.valid[:, None])
    found = detected(replace(experiment, trials=(changed, *experiment.trials[1:])))
    assert found.log10_p > -6.0


SHOWN = 300  # samples of two encoders that rest otherwise


@pytest.fixture
def resting(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both encoders show a tenth of every trial."""

    def windows(experiment: Experiment, trial: Trial, valid: Mask) -> Array:
        part = valid & (np.arange(N) < SHOWN)
        return np.stack([window_of(part if k >= experiment.loads else valid) for k in range(CHANNELS)], axis=1)

    monkeypatch.setattr(floor, "channel_windows", windows)


@pytest.mark.usefixtures("resting")
def test_channels_that_show_little_leave_p_values_uniform() -> None:
    found = [detected(made(seed, 3, np.zeros((N, CHANNELS)))) for seed in range(8)]
    p = np.array([float(np.exp(cell.log_p)) for one in found for cell in one.cells])
    assert 0.0 <= np.mean(p < 0.05) < 0.13
    assert 0.35 < np.mean(p) < 0.7  # what the floor is known by is taken for more than it is
    assert np.mean([one.ratio for one in found]) == pytest.approx(1.0, abs=0.06)


def test_channels_that_show_little_do_not_hide_what_others_show(request: pytest.FixtureRequest) -> None:
    t = bench.DT * np.arange(N)
    tone: Array = np.zeros((N, CHANNELS))
    tone[:, 3] = 3e-4 * np.sin(2.0 * np.pi * 1.5 * t)
    whole = min(cell.log_p for cell in detected(made(3, 3, tone)).cells)
    request.getfixturevalue("resting")
    part = min(cell.log_p for cell in detected(made(3, 3, tone)).cells)
    assert part < 0.8 * whole < np.log(1e-4)


def _log_p(cell: Cell) -> float:
    return cell.log_p


@pytest.mark.parametrize("repeats", [2, 4])
def test_ratio_is_one_for_noise(repeats: int) -> None:
    assert detected(made(20, repeats, np.zeros((N, CHANNELS)))).ratio == pytest.approx(1.0, abs=0.12)
