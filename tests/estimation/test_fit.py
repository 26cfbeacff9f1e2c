"""MAP fits with known answers, honest intervals for white and coloured noise, and refusals that name the cause."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from kbs_process.errors import FitError
from kbs_process.estimation.fit import Parameters, fit_map
from kbs_process.estimation.longrun import longrun_covariance


def _line(n=200):
    t = np.linspace(-1, 1, n)
    return np.stack([np.ones(n), t, t**2], axis=1)


def _parameters(sigma, value=(0.0, 0.0, 0.0)):
    return Parameters(("a", "b", "c"), np.array(value), np.broadcast_to(np.asarray(sigma, float), 3).copy())


def _longrun(r, J):
    return longrun_covariance(r[:, None] * J)


def test_linear_problem_without_prior_is_least_squares():
    A, rng = _line(), np.random.default_rng(0)
    y = A @ [1.0, -2.0, 0.5] + 0.1 * rng.standard_normal(len(A))
    fit = fit_map(lambda x: (A @ x - y) / 0.1, _parameters(np.inf))
    np.testing.assert_allclose(fit.value, np.linalg.lstsq(A, y)[0], atol=1e-9)
    np.testing.assert_allclose(fit.covariance, 0.01 * np.linalg.inv(A.T @ A), rtol=1e-6, atol=1e-15)
    assert fit.ok
    assert fit.residual_rms == pytest.approx(1.0, abs=0.15)


def test_linear_problem_with_prior_is_the_weighted_mean():
    fit = fit_map(lambda x: (x - 3.0) / 0.5, Parameters(("a",), np.array([1.0]), np.array([1.0])))
    assert fit["a"] == pytest.approx((3.0 / 0.25 + 1.0) / 5.0)
    assert fit.sigma[0] == pytest.approx(1 / np.sqrt(5.0))


def test_rosenbrock_is_solved():
    parameters = Parameters(("x", "y"), np.array([-1.2, 1.0]), np.full(2, np.inf))
    fit = fit_map(lambda p: np.array([10 * (p[1] - p[0] ** 2), 1 - p[0]]), parameters)
    np.testing.assert_allclose(fit.value, [1.0, 1.0], atol=1e-6)
    assert fit.checks[0].passed
    assert "x with y" in fit.checks[2].detail  # the valley: correlation 0.9988


@pytest.mark.parametrize("rho", [0.0, 0.6, 0.9])
def test_intervals_cover_the_truth_for_white_and_coloured_noise(rho):
    A, rng, trials, inside = _line(600), np.random.default_rng(1), 200, 0
    truth = np.array([1.0, -2.0, 0.5])
    for _ in range(trials):
        noise = lfilter([np.sqrt(1 - rho**2)], [1, -rho], rng.standard_normal(800))[200:]
        y = A @ truth + noise
        fit = fit_map(lambda x, y=y: A @ x - y, _parameters(np.inf), jacobian=lambda x: A, scores=_longrun)
        inside += np.sum(np.abs(fit.value - truth) < 1.96 * fit.sigma)
    coverage = inside / (3 * trials)
    assert 0.88 < coverage < 0.985


def test_coloured_noise_would_be_underestimated_without_its_series():
    A, rng = _line(600), np.random.default_rng(2)
    y = lfilter([np.sqrt(1 - 0.9**2)], [1, -0.9], rng.standard_normal(800))[200:]
    white = fit_map(lambda x: A @ x - y, _parameters(np.inf))
    coloured = fit_map(lambda x: A @ x - y, _parameters(np.inf), scores=_longrun)
    assert np.all(coloured.sigma > 2.0 * white.sigma)


def test_singular_fit_names_the_combination():
    A = _line()
    B = np.stack([A[:, 0], A[:, 1], 2.0 * A[:, 1]], axis=1)
    with pytest.raises(FitError, match=r"cannot tell these parameters apart: .*\bc\b.*") as caught:
        fit_map(lambda x: B @ x - A[:, 1], _parameters(np.inf))
    assert " b" in str(caught.value)
    assert " a" not in str(caught.value).split("apart:")[1].split("->")[0]


def test_parameter_without_effect_and_prior_is_named():
    B = _line()
    B[:, 1] = 0.0
    with pytest.raises(FitError, match="say nothing about b"):
        fit_map(lambda x: B @ x - 1.0, _parameters(np.inf))


def test_weak_parameters_and_bounds_are_reported():
    A = _line()
    B = np.stack([A[:, 0], A[:, 0], A[:, 1]], axis=1)
    lower = np.array([-np.inf, -np.inf, 0.5])
    parameters = Parameters(("a", "b", "c"), np.array([0.0, 0.0, 1.0]), np.ones(3), lower)
    fit = fit_map(lambda x: (B @ x - A[:, 0]) / 1.0, parameters)
    details = {check.name: check for check in fit.checks}
    assert "a with b" in details["identifiable"].detail
    sharp = fit_map(lambda x: (B @ x - A[:, 0]) / 0.01, parameters)
    assert sharp["c"] == 0.5
    assert "at a bound: c" in {c.name: c for c in sharp.checks}["within bounds"].detail
    assert not sharp.ok
