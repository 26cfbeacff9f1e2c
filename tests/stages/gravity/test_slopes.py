"""The equation's slopes by every parameter are what moving that parameter makes."""

from __future__ import annotations

import numpy as np
import pytest

from kbs_process.stages import motion
from kbs_process.stages.gravity import model as gravity
from kbs_process.stages.gravity.equation import Equation
from plant.rigs import pointing_rig
from stages.gravity.synthetic import record, staircase


@pytest.mark.parametrize("inertia", [False, True])
def test_slopes_are_those_of_what_is_predicted(inertia):
    rig = pointing_rig()
    q = np.stack([staircase(60, [0.1, 0.8, -0.4]), staircase(60, [0.4, 0.9, 1.2])], axis=1)
    run = record(rig, "run", q, np.random.default_rng(0))
    equation = Equation.of(rig, include_inertia=inertia, cross_coupling=True, response_sigma=None)
    sample = gravity.Sample("run", motion.estimate(run, rig, motion.MotionSettings(source="encoder")), run.wrench)
    theta = equation.start()
    data = gravity.prepared(sample, equation, gravity.GravitySettings(), 1.0, theta)
    J = equation.jacobian(theta, data).reshape(*data.wrench.shape, equation.size)
    for column, (name, sigma) in enumerate(zip(equation.names, equation.sigma(), strict=True)):
        step = np.where(np.arange(equation.size) == column, 1e-3 * sigma, 0.0)
        moves = equation.predict(theta + step, data) - equation.predict(theta - step, data)
        np.testing.assert_allclose(
            J[:, :, column] * sigma, 500.0 * moves, rtol=0, atol=0.01 * np.abs(500 * moves).max() + 1e-9, err_msg=name
        )
