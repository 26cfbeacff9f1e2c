"""The floor out of repeats, and the whitening by it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from diagnosis import bench
from kbs_process.diagnosis.experiments import floor
from kbs_process.diagnosis.experiments.experiment import Drive, Experiment, Trial
from kbs_process.diagnosis.experiments.whiten import Projector
from kbs_process.signals.records import Array
from kbs_process.stages.align.resample import resample

N = 3000
CHANNELS = 8


def coloured(rng: np.random.Generator, n: int) -> Array:
    """Noise of EL089's size, red and alike in two channels."""
    white = rng.standard_normal((n, CHANNELS))
    red = lfilter([0.3], [1.0, -0.97], rng.standard_normal((n + 500, CHANNELS)), axis=0)[500:]
    noise = white + red
    noise[:, 4] = 0.8 * noise[:, 3] + 0.6 * noise[:, 4]
    level = np.array([0.01] * 3 + [0.001] * 3 + [2e-4] * 2)
    return np.asarray(level * noise)


def made(seed: int, repeats: int, common: Array) -> Experiment:
    rig = bench.unrounded(bench.rig())
    rng = np.random.default_rng(seed)
    channels = (*rig.transducer.channels, *rig.joint_names)
    drive = Drive(0, N, bench.schedule(N * bench.DT), None, 100.0, 100.0)
    valid = np.ones(N, dtype=np.bool_)
    valid[1200:1230] = False
    trials = tuple(
        Trial(f"r{k}", "fit", 0, 0, (common + coloured(rng, N)) * valid[:, None], valid, 100.0, 100.0, 0.0, 0.0, None)
        for k in range(repeats)
    )
    return Experiment(rig, bench.effects(), bench.DT, channels, ("",) * CHANNELS, (drive,), trials, 8.0)


def mismatch() -> Array:
    """What comes again in every repeat, a hundred times the noise."""
    t = bench.DT * np.arange(N)[:, None]
    return np.asarray(0.5 * np.sin(2.0 * np.pi * t * np.linspace(0.1, 3.0, CHANNELS)))


def test_repeats_whiten_noise_they_were_not_made_of_whatever_is_common() -> None:
    experiment = made(1, 3, mismatch())
    left = {k: trial.measured for k, trial in enumerate(experiment.trials)}
    found = floor.estimate(experiment, left)
    assert found.source == "repeats"
    fresh = made(2, 1, np.zeros((N, CHANNELS))).trials[0]
    whiten = found.whitener(fresh, np.zeros((N, CHANNELS)))
    z = whiten(fresh.measured).reshape(whiten.shape)
    # 38 000 numbers, the floor known to some per cent
    assert np.mean(z**2) == pytest.approx(1.0, abs=0.06)
    by_channel = np.mean(z**2, axis=(0, 1))
    assert np.all((by_channel > 0.85) & (by_channel < 1.18))
    assert abs(np.mean(z[:, :, 3] * z[:, :, 4])) < 0.05  # alike in time, not once whitened
    neighbours = np.mean(z[:, 1:] * z[:, :-1])
    assert abs(neighbours) < 0.04


def test_without_repeats_the_data_sheet_is_the_floor_and_says_so() -> None:
    experiment = made(3, 1, np.zeros((N, CHANNELS)))
    found = floor.estimate(experiment, {0: experiment.trials[0].measured})
    assert found.source == "declared"
    assert "no trajectory was repeated" in found.statement
    f = np.array([0.05, 5.0])
    density = found.repeats(experiment.trials[0], f)[:, 0, 0].real
    white = (0.02**2 + 0.0078125**2 / 12.0) * 2.0 / 100.0
    assert density == pytest.approx([2.0 * white, 1.01 * white], rel=1e-6)


def test_encoders_at_rest_say_nothing_and_moving_ones_round() -> None:
    experiment = bench.experiment(bench.rig(), ("fit",), seed=1)
    trial = experiment.trials[0]
    held = replace(trial, measured=np.where(np.arange(CHANNELS) == 6, 0.1, trial.measured))
    windows = floor.channel_windows(experiment, held, held.valid)
    assert not windows[:, 6].any()
    assert windows[:, 7].any()
    assert windows[:, 0].any()


def test_an_encoder_at_rest_beside_a_gap_says_nothing_either() -> None:
    """What is missing is zero in a trial, and no motion."""
    experiment = bench.experiment(bench.rig(), ("fit",), seed=1)
    trial = experiment.trials[0]
    valid = trial.valid.copy()
    valid[100:130] = False
    measured = np.where(np.arange(CHANNELS) == 6, 0.5, trial.measured) * valid[:, None]
    gappy = replace(trial, measured=measured, valid=valid)
    assert not floor.channel_windows(experiment, gappy, valid)[:, 6].any()
    assert floor.channel_windows(experiment, gappy, valid)[:, 7].any()


def test_rounding_along_a_path_is_that_of_codes() -> None:
    """Against rounding itself, at an offset that the estimate does not know."""
    experiment = bench.experiment(bench.rig(), ("fit",), seed=1)
    trial = experiment.trials[0]
    n = len(trial.valid)
    t = np.arange(5 * n) / 100.0
    fine = 0.004 * t + 0.005 * np.sin(0.3 * t)
    step = floor.encoder_steps(experiment)[1]
    read = step * np.round(fine / step + 0.37)
    path = np.zeros((n, CHANNELS))
    path[:, 7] = fine[::5]
    moving = replace(trial, measured=path)
    windows = floor.channel_windows(experiment, moving, moving.valid)
    f = np.linspace(0.2, 7.5, 100)
    expected = floor.rounding(experiment, moving, path, windows, f)[:, 1]
    error = resample((read - fine)[:, None], 100.0, 20.0)[:n, 0]
    window = windows[:, 7]
    error -= (error @ window) / window.sum()
    power = np.abs(np.fft.rfft(error * window)) ** 2 * 2.0 * bench.DT / (window @ window)
    every = np.fft.rfftfreq(n, bench.DT)
    for low, high in ((0.2, 2.0), (2.0, 7.5)):
        actual = np.mean(power[(every >= low) & (every <= high)])
        assert np.mean(expected[(f >= low) & (f <= high)]) == pytest.approx(actual, rel=0.4)


def test_projector_takes_free_nuisances_out_and_bounded_ones_within_their_prior() -> None:
    rng = np.random.default_rng(5)
    N_columns, z = rng.standard_normal((200, 3)), rng.standard_normal(200)
    precision = np.array([0.0, 0.0, 4.0])
    project = Projector.of(N_columns, precision)
    shifted = project(z + N_columns[:, :2] @ np.array([5.0, -7.0]))
    assert shifted == pytest.approx(project(z), abs=1e-9)
    # squared length = least cost over the amplitudes
    A = np.vstack([N_columns, np.diag(precision)])
    b = np.concatenate([z, np.zeros(3)])
    left = b - A @ np.linalg.lstsq(A, b, rcond=None)[0]
    assert float(np.sum(project(z) ** 2)) == pytest.approx(float(left @ left), rel=1e-9)


def test_of_two_floors_the_smaller_is_taken_whichever_comes_first() -> None:
    """A model that is wrong about what differs from run to run adds that to what repeats differ by."""
    one = made(5, 3, np.zeros((N, CHANNELS)))
    right = {k: trial.measured for k, trial in enumerate(one.trials)}
    wrong = {k: x + 3.0 * k * coloured(np.random.default_rng(90 + k), N) for k, x in right.items()}
    floors = floor.estimate(one, right), floor.estimate(one, wrong)
    assert floor.smaller(*floors) is floors[0]
    assert floor.smaller(*reversed(floors)) is floors[0]
