"""Whitening and projection: unit variance, noise levels found, nuisances as good as jointly fitted."""

from __future__ import annotations

import numpy as np
import pytest

from kbs_process.estimation.whittle import StepSpectrum, estimated, flat, project, whitener

N, DT = 8192, 0.01


def coloured(seed: int) -> np.ndarray:
    """Noise whose density is 4 times greater below 5 Hz than above."""
    rng = np.random.default_rng(seed)
    f = np.fft.rfftfreq(N, DT)
    spectrum = np.fft.rfft(rng.standard_normal(N)) * np.where(f < 5.0, 2.0, 1.0)
    return np.fft.irfft(spectrum, N)


def test_whitened_noise_has_unit_variance_in_every_band() -> None:
    noise = StepSpectrum(np.array([0.0, 5.0, 50.0]), np.array([8.0 * DT, 2.0 * DT]))
    valid = np.ones(N, dtype=bool)
    for band in ((0.5, 4.0), (6.0, 40.0), (0.5, 40.0)):
        z = whitener(valid, DT, band, noise)(coloured(1))
        assert np.mean(z**2) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / len(z)))


def test_spectrum_is_estimated_to_its_stated_accuracy_also_with_a_gap() -> None:
    valid = np.ones(N, dtype=bool)
    valid[3000:4000] = False
    found = estimated(coloured(2), valid, DT, (0.5, 40.0))
    f = np.array([1.0, 3.0, 10.0, 30.0])
    np.testing.assert_allclose(found.at(f), np.where(f < 5.0, 8.0, 2.0) * DT, rtol=0.6)
    assert np.mean(found.at(np.linspace(10.0, 39.0, 50))) == pytest.approx(2.0 * DT, rel=0.1)


def test_projection_leaves_what_a_joint_fit_leaves() -> None:
    rng = np.random.default_rng(3)
    z, x, nuisances = rng.standard_normal(200), rng.standard_normal(200), rng.standard_normal((200, 3))
    priors = np.array([0.0, 0.5, 20.0])
    whole = np.vstack([np.column_stack([x, nuisances]), np.column_stack([np.zeros(3), np.diag(priors)])])
    joint = np.linalg.lstsq(whole, np.concatenate([z, np.zeros(3)]), rcond=None)[0][0]
    zp, xp = project(z, nuisances, priors), project(x, nuisances, priors)
    assert xp @ zp / (xp @ xp) == pytest.approx(joint, rel=1e-9)


def test_flat_density_holds_everywhere() -> None:
    np.testing.assert_array_equal(flat(3.0).at(np.array([0.0, 1e6])), 3.0)
