"""What is misread in one recording: found by what gravity leaves of it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from kbs_process.stages import motion
from kbs_process.stages.gravity import model as gravity
from kbs_process.stages.gravity.equation import Equation
from kbs_process.stages.gravity.tension import misread
from plant.rigs import pointing_rig
from stages.gravity.synthetic import record, staircase


def misread_in(change):
    """What is found where a change of the angles (n, joints) is read."""
    rig = pointing_rig()
    q = np.stack([staircase(60, [0.1, 0.8, -0.4]), staircase(60, [0.4, 0.9, 1.2])], axis=1)
    run = record(rig, "test", q, np.random.default_rng(0))
    run = replace(run, angle=run.angle.derive(change(run.angle.values), "read"))
    equation = Equation.of(rig, include_inertia=False, cross_coupling=False, response_sigma=None)
    sample = gravity.Sample("test", motion.estimate(run, rig, motion.MotionSettings(source="encoder")), run.wrench)
    data = gravity.prepared(sample, equation, gravity.GravitySettings(), 1.0, equation.start())
    fitted = SimpleNamespace(rig=rig, equation=equation, fit=SimpleNamespace(value=equation.start()))
    return [(one.what, one.value) for one in misread(fitted, data)]


@pytest.mark.parametrize(
    ("change", "what", "value"),
    [
        (lambda q: q[:, ::-1], "the order of the angles of az and el", -1.0),
        (lambda q: q * np.array([1.0, -1.0]), "the sign of el's angle", -1.0),
        (lambda q: q + np.array([0.0, 0.05]), "the zero of el's angle (degrees)", np.degrees(0.05)),
    ],
)
def test_angles_that_are_misread_are_named(change, what, value):
    ((found, by),) = misread_in(change)
    assert found == what and by == pytest.approx(value, abs=0.15)


def test_angles_that_are_read_rightly_are_not():
    assert misread_in(lambda q: q) == []
