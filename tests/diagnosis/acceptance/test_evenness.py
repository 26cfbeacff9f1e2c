"""Amplitudes known by how they change where a part is left out: by noise as noise says, of a stand-in not at all."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
import pytest

from kbs_process.diagnosis.acceptance.evenness import evenly, parts
from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.metric import Metric
from kbs_process.diagnosis.experiments.whiten import Projector, whitener
from kbs_process.signals.records import Array

DT, N, CHANNELS = 0.02, 12000, 3  # 240 s: 15 windows
SIGMA = 0.3


@dataclass(frozen=True)
class Trial:
    measured: Array
    trajectory: int


@dataclass(frozen=True)
class Recordings:
    trials: tuple[Trial, ...]
    dt: float


EXPERIMENT = cast(Experiment, Recordings(tuple(Trial(np.zeros((N, CHANNELS)), k // 2) for k in range(4)), DT))


def metric() -> Metric:
    """Of white noise of SIGMA in each of three channels, all of which count whole."""
    windows = np.ones((N, CHANNELS))
    density = np.tile(2.0 * DT * SIGMA**2 * np.eye(CHANNELS), (N // 2 - 1, 1, 1)).astype(complex)
    whiten = whitener(windows, DT, (0.0, 0.5 / DT - 1e-9), density)
    rows = 2 * len(whiten.f) * CHANNELS
    return Metric(whiten, np.ones(CHANNELS), Projector.of(np.zeros((rows, 0)), np.zeros(0)))


def sigmas(law: Array, recorded: Array) -> tuple[float, float]:
    """By how many sigmas the law's one amplitude is off zero: by the noise, and by what parts ask for."""
    of = metric()
    S, z = of(law), of(recorded)
    a = float(S @ z / (S @ S))
    return abs(a) * float(np.linalg.norm(S)), evenly(EXPERIMENT, {0: parts(EXPERIMENT, 0, of, a * S, z - a * S)})


def law_and_noise(seed: int = 3) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    t = DT * np.arange(N)
    law = np.stack([np.sin(2 * np.pi * 0.4 * t), 0.5 * np.sin(2 * np.pi * 0.9 * t), np.cos(t)], axis=1)
    return law, SIGMA * rng.standard_normal((N, CHANNELS))


def test_a_law_that_is_there_in_noise_is_known_as_well_as_the_noise_says() -> None:
    law, noise = law_and_noise()
    by_noise, by_scatter = sigmas(law, 0.2 * law + noise)
    assert by_scatter == pytest.approx(by_noise, rel=0.3)
    assert by_noise > 40.0


def test_parts_add_up_to_the_whole_product() -> None:
    """Parseval, channel by channel."""
    law, noise = law_and_noise()
    of = metric()
    S, z = of(law), of(noise)
    pull, done = parts(EXPERIMENT, 0, of, S, z)
    assert pull.shape == done.shape == (15, CHANNELS)
    assert pull.sum() == pytest.approx(float(S @ z), rel=1e-6)
    assert done.sum() == pytest.approx(float(S @ S), rel=1e-6)


def test_what_asks_for_more_here_and_for_less_there_is_not_there() -> None:
    """A law of other sizes in every window and channel, of which a mean is left, many sigmas of the noise off zero."""
    law, noise = law_and_noise()
    rng = np.random.default_rng(4)
    sizes = np.repeat(rng.normal(0.3, 1.5, (15, CHANNELS)), N // 15, axis=0)
    by_noise, by_scatter = sigmas(law, sizes * law + noise)
    assert by_noise > 40.0
    assert by_scatter < 8.0


@pytest.mark.parametrize("seed", range(20))
def test_what_one_part_alone_shows_is_known_by_none(seed: int) -> None:
    """A law that acts for some seconds in one channel, and follows exactly what is there."""
    law, noise = law_and_noise(seed)
    short = np.zeros_like(law)
    short[5200:5400, 1] = law[5200:5400, 1]
    by_noise, by_scatter = sigmas(short, 5.0 * short + noise)
    assert by_noise > 40.0
    assert by_scatter < 2.0


@pytest.mark.parametrize("size", [0.4, 0.6, 1.0, 1.3])
def test_a_law_whose_fit_has_not_ended_is_known_as_well(size: float) -> None:
    law, noise = law_and_noise()
    of = metric()
    S, z = 0.2 * of(law), of(0.2 * law + noise)
    found = evenly(EXPERIMENT, {0: parts(EXPERIMENT, 0, of, size * S, z - size * S)})
    assert found == pytest.approx(float(np.linalg.norm(S)), rel=0.3)


def test_what_repeats_leave_over_alike_says_no_more_together() -> None:
    """A stand-in, twice along each of two trajectories; noise of their own makes a law that is there better known."""
    law, _ = law_and_noise()
    sizes = np.repeat(np.random.default_rng(4).normal(0.3, 1.5, (15, CHANNELS)), N // 15, axis=0)
    of = metric()
    S, z = of(law), of(sizes * law)
    a = float(S @ z / (S @ S))
    one = parts(EXPERIMENT, 0, of, a * S, z - a * S)
    alone = evenly(EXPERIMENT, {0: one})
    assert evenly(EXPERIMENT, {0: one, 1: one}) == pytest.approx(alone, rel=1e-9)
    assert evenly(EXPERIMENT, {0: one, 2: one}) > 1.2 * alone
    z = 0.2 * S
    repeats = {k: parts(EXPERIMENT, k, of, z, of(law_and_noise(k)[1])) for k in (0, 1)}
    assert evenly(EXPERIMENT, repeats) == pytest.approx(np.sqrt(2.0) * float(np.linalg.norm(z)), rel=0.3)


def test_what_one_cause_leaves_in_all_channels_is_no_evidence_in_each() -> None:
    law, noise = law_and_noise()
    same = np.repeat(law[:, :1], CHANNELS, axis=1)
    sizes = np.repeat(np.random.default_rng(6).normal(0.3, 1.5, (15, 1)), N // 15, axis=0)
    _, together = sigmas(same, sizes * same + noise)
    _, alone = sigmas(same * [1.0, 0.0, 0.0], sizes * same * [1.0, 0.0, 0.0] + noise)
    assert together == pytest.approx(alone, rel=0.05)
