"""The fit of rigid bodies to efforts: a linear axis whose drive is described, without a transducer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kbs_process.plant.rigid import loads
from kbs_process.rig.model import Effort, Rig, no_transducer, substitute
from kbs_process.signals.records import Run, Signal
from kbs_process.stages import motion
from kbs_process.stages.gravity import model as gravity
from kbs_process.stages.gravity.model import GravitySettings, Sample
from kbs_process.stages.motion import MotionSettings
from plant.rigs import body, joint, quantity, smooth_motion

pytestmark = pytest.mark.slow

DT = 0.01
TRUE = {"body.car.mass": 95.0, "joint.axis.viscous": 240.0}
NOISE = 0.5


def axis(bias_sigma):
    """Nominal rig: 110 kg and 150 N s/m, within a sigma of the truth."""
    at = "joint.axis.effort"
    measured = Effort(
        "N",
        quantity(f"{at}.gain", 1.0),
        quantity(f"{at}.bias", 0.0, bias_sigma),
        quantity(f"{at}.noise", NOISE),
        quantity(f"{at}.resolution", 0.0),
    )
    made = replace(
        joint("axis", "lab", (1, 0, 0)),
        type="prismatic",
        viscous=quantity("joint.axis.viscous", 150.0, 100.0),
        effort=measured,
    )
    return Rig(
        quantity("gravity.magnitude", 9.80665),
        no_transducer(),
        (body("car", "axis", 110.0, [0, 0, 0], [0] * 6, s_mass=20.0, s_cog=0.0),),
        (made,),
        None,
        None,
    )


def sample(rig, offset):
    """Forty seconds of motion and force, at the working rate."""
    _, q, qd, qdd = smooth_motion(1, seconds=40.0, rate=1.0 / DT, seed=3)
    rng = np.random.default_rng(5)
    force = loads(substitute(rig, TRUE), q, qd, qdd)[:, 6:] + offset + rng.normal(0.0, NOISE, q.shape)
    valid = np.ones(len(q), dtype=bool)
    effort = Signal(0.0, DT, force, ("axis.effort",), ("N",), "joint", valid)
    way = Signal(0.0, DT, q, ("axis",), ("m",), "joint", valid)
    run = Run("run", None, way, None, None, None, None, None, None, None, 0, effort=effort)
    assert run.loads is effort
    return Sample("run", motion.estimate(run, rig, MotionSettings(band_Hz=10.0)), run.loads)


@pytest.mark.parametrize(("offset", "bias_sigma"), [(0.0, 0.0), (7.0, 20.0)])
def test_mass_and_friction_are_found_and_a_zero_only_where_one_may_be(offset, bias_sigma):
    rig = axis(bias_sigma)
    model = gravity.fit(
        [sample(rig, offset)], rig, include_inertia=True, settings=GravitySettings(low_pass_Hz=5.0, response=True)
    )
    for name, value in TRUE.items():
        found = float(model.rig.quantities()[name])
        sigma = float(model.rig.quantities()[name].sigma)
        assert sigma < 0.01 * value
        assert abs(found - value) < 4.0 * sigma
    zeros = [name for name in model.fit.names if "[run]" in name]
    assert len(zeros) == (3 if bias_sigma else 0)  # constant, drift and its curvature
    assert model.taring["run"].bias[0] == pytest.approx(offset, abs=0.2)
    assert (model.channels, model.units) == (("axis.effort",), ("N",))
    assert not any(name.startswith("response") for name in model.fit.names)  # a transducer's, and there is none


def test_the_model_is_what_the_effort_reads():
    rig = axis(0.0)
    data = sample(rig, 0.0)
    model = gravity.fit([data], rig, include_inertia=True, settings=GravitySettings(low_pass_Hz=5.0, response=True))
    predicted = gravity.apply(data.motion, model)
    assert predicted.wrench.frame == "joint"
    inner = slice(100, -100)
    left = (data.wrench.values - predicted.wrench.values)[inner, 0]
    assert np.std(left) == pytest.approx(NOISE, rel=0.1)
