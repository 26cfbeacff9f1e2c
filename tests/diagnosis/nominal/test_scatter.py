"""Fitted numbers are known to by what recordings ask for apart, not by the noise alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from diagnosis.selection.test_rounds import FREE
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.diagnosis.nominal.scatter import ENDED, scattered
from kbs_process.identification.output_error import Scalar
from kbs_process.signals.records import Array

pytestmark = pytest.mark.slow

DAMPING = FREE.index(Scalar("joint.el.drive.b_m"))


@pytest.fixture(scope="module")
def known() -> Known:
    """Numbers of which nothing but recordings says anything, with the covariance by the noise."""
    made = bench.experiment(bench.rig(), ("fit",) * 4, 5)
    begun = bench.standing(made, FREE).known
    free = replace(begun.parameters, sigma=np.full(len(FREE), np.inf))
    H = sum((begun.jacobian(k).T @ begun.jacobian(k) for k in made.fit), np.zeros((len(FREE), len(FREE))))
    return replace(begun, parameters=free, covariance=np.linalg.inv(H))


def pulled(known: Known, numbers: Array) -> Known:
    """The same where recording k shows the rig with its own `numbers[k]` (trials, p), and nothing else."""
    left = tuple(known.jacobian(k) @ own for k, own in enumerate(numbers))
    return replace(known, residual=left)


def test_numbers_that_differ_from_run_to_run_are_known_to_their_scatter(known: Known) -> None:
    """A mean of four, to half the scatter of one; by the noise it would be far better known."""
    noise, spread = float(known.sigma[DAMPING]), 50.0 * float(known.sigma[DAMPING])
    own = np.zeros((4, len(FREE)))
    own[:, DAMPING] = spread * np.array([1.0, -1.0, 1.0, -1.0])
    found = np.sqrt(np.diag(scattered(pulled(known, own))))[DAMPING] / ENDED
    assert found == pytest.approx(np.hypot(noise, spread * np.sqrt(4 / 3) / 2.0), rel=0.02)


def test_what_all_recordings_leave_alike_is_no_scatter(known: Known) -> None:
    own = np.zeros((4, len(FREE)))
    own[:, DAMPING] = 30.0 * known.sigma[DAMPING]
    np.testing.assert_allclose(scattered(pulled(known, own)), ENDED**2 * known.covariance, rtol=1e-6)


def test_nothing_is_known_to_less_than_its_prior_says(known: Known) -> None:
    told = replace(known, parameters=replace(known.parameters, sigma=0.5 * known.sigma))
    np.testing.assert_allclose(np.sqrt(np.diag(scattered(told))), told.parameters.sigma, rtol=1e-9)
