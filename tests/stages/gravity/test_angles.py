"""Encoder rounding in the fit's covariance: it belongs to the angle, so that resting longer does not average it out."""

from __future__ import annotations

import numpy as np
import pytest

from kbs_process.stages import motion
from kbs_process.stages.gravity import model as gravity
from kbs_process.stages.gravity.angles import Rounding
from kbs_process.stages.gravity.equation import Equation
from plant.rigs import pointing_rig
from stages.gravity.synthetic import FINE, record


def _scores_of_ty(elevation):
    """Standard deviation of the sum of Ty's errors through rounding along an elevation (n,), at unit weight."""
    rig = pointing_rig()
    q = np.stack([np.full_like(elevation, 0.3), elevation], axis=1)
    run = record(rig, "run", q, np.random.default_rng(0))
    moving = motion.estimate(run, rig, motion.MotionSettings(source="encoder"))
    equation = Equation.of(rig, include_inertia=False, cross_coupling=False, response_sigma=None)
    sample = gravity.Sample("run", moving, run.wrench)
    data = gravity.prepared(sample, equation, gravity.GravitySettings(), 1.0, equation.start())
    c = len(equation.channels)
    rounding = Rounding(equation, equation.start(), 1)
    rounding.add(data, np.ones(c), np.tile(np.eye(c)[:, [4]], (len(data.q), 1, 1)), np.array([0]))
    S = rounding.scores()
    slope = equation.angle_slopes(equation.start(), data)[:, 4, :]
    return float(np.sqrt(S[0, 0])) / len(data.q), np.abs(slope).mean(axis=0)


def test_at_rest_the_mean_errs_by_a_codes_rounding_however_long_the_rest():
    step = float(pointing_rig().joints[0].encoder.step)
    for seconds in (60, 240):
        error, slope = _scores_of_ty(np.full(int(seconds * FINE), 1.2))
        assert error == pytest.approx(np.hypot(*slope) * step / np.sqrt(12), rel=0.1)


def test_two_rests_err_independently_and_a_moving_joint_hardly():
    t = np.arange(int(120 * FINE)) / FINE
    step = float(pointing_rig().joints[0].encoder.step)
    azimuth, slope = _scores_of_ty(np.where(t < 60, 1.2, 1.2003 + 100 * step))
    moving, _ = _scores_of_ty(0.8 + 5e-3 * t)
    rest = slope * step / np.sqrt(12)
    assert azimuth == pytest.approx(np.hypot(rest[0], rest[1] / np.sqrt(2)), rel=0.15)
    assert moving == pytest.approx(rest[0], rel=0.35)
