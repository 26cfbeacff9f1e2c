"""Stated sigmas of fitted parameters and of the subtracted wrench, on campaigns drawn by the independent engine.

`python -m stages.gravity.drawn_rigs` does the same with drives and with as many campaigns as asked for.
"""

from __future__ import annotations

import numpy as np
import pytest

from kbs_process.estimation.flicker import fit_flicker, flicker_scores
from stages.gravity.drawn_rigs import INFORMED, lines, make, score

SEEDS = range(8000, 8003)  # ACQ600's, AESTPP00's and ELSTPP00's trajectories


@pytest.fixture(scope="module")
def scores():
    found = [score(*make(seed, still=True)) for seed in SEEDS]
    print("", *lines(found), sep="\n")
    return found


@pytest.mark.validation
def test_fitted_parameters_lie_within_their_sigmas_as_often_as_they_should(scores):
    z, gain = (np.concatenate([getattr(one, key) for one in scores]) for key in ("z", "gain"))
    informed = z[gain > INFORMED]
    assert len(informed) > 36
    assert np.sqrt(np.mean(z**2)) < 1.1
    assert np.mean(np.abs(z) < 2.0) > 0.92
    assert 0.6 < np.sqrt(np.mean(informed**2)) < 1.4
    assert np.mean(np.abs(informed) < 2.0) > 0.83


@pytest.mark.validation
def test_torques_of_a_held_out_recording_are_as_wrong_in_the_band_as_stated(scores):
    wrong, stated = (
        np.sqrt(np.mean([getattr(one, key)[3:5] ** 2 for one in scores], axis=0)) for key in ("wrong", "stated")
    )
    assert np.all(wrong < 2.0 * stated)
    assert np.all(wrong > 0.3 * stated)


def pink(rng, n, dt, knee):
    """White noise of unit variance with 1/f noise as strong at `knee` Hz, made in the frequency domain."""
    f = np.fft.rfftfreq(4 * n, dt)
    shape = np.sqrt(1.0 + knee / np.maximum(f, f[1]))
    return np.fft.irfft(np.fft.rfft(rng.standard_normal(4 * n)) * shape, 4 * n)[:n]


@pytest.mark.slow
def test_one_over_f_noise_is_told_from_white():
    rng = np.random.default_rng(1)
    found = [fit_flicker(pink(rng, 1600, 0.25, 0.05), 0.25, 1.0) for _ in range(20)]
    assert np.mean([noise.white for noise in found]) == pytest.approx(1.0, rel=0.1)
    assert np.mean([noise.pink for noise in found]) == pytest.approx(0.05, rel=0.25)


@pytest.mark.slow
def test_scores_variance_of_a_slow_signal_in_one_over_f_noise_is_that_of_many_records():
    rng = np.random.default_rng(2)
    n, dt = 1600, 0.25
    J = np.sin(2 * np.pi * 5 * np.arange(n) / n + 0.4)[:, None]
    noises = [pink(rng, n, dt, 0.05) for _ in range(200)]
    stated = np.mean([flicker_scores(x[:, None], J[:, None], dt, 1.0)[0, 0] for x in noises[:40]])
    assert stated == pytest.approx(np.var([J[:, 0] @ x for x in noises]), rel=0.35)
