"""What each part of the gravity model is worth: a rig that has one of them needs that rung, and no other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kbs_process.rig.model import Rig, substitute
from kbs_process.signals.records import Array
from kbs_process.stages import motion
from kbs_process.stages.gravity import model as gravity
from kbs_process.stages.gravity.ladder import ladder
from plant.rigs import pointing_rig
from stages.gravity.synthetic import record, staircase

TORQUES = slice(3, 6)
NOISE = np.repeat([0.002, 0.0002], 3)


def angles() -> Array:
    return np.stack([staircase(90.0, np.linspace(-2.5, 2.5, 7)), staircase(90.0, [1.25, 1.5, 0.2, -0.4, 1.0])], axis=1)


def rungs(truth: Rig, described: Rig) -> dict[str, tuple[float, float]]:
    """Greatest rms and peak of a torque that each rung leaves, N m."""
    run = record(truth, "calibration", angles(), np.random.default_rng(1), noise=NOISE)
    samples = [gravity.Sample(run.name, motion.estimate(run, described), run.wrench, calibration=True)]
    model = gravity.fit(samples, described, include_inertia=False)
    return {
        rung.name: (float(rung.rms[TORQUES].max()), float(rung.peak[TORQUES].max())) for rung in ladder(samples, model)
    }


def test_a_tilted_rig_needs_the_tilt_and_no_more() -> None:
    """A tilt of 3 mrad turns 20 kg of moving mass: its torque about z changes by some 0.03 N m as azimuth turns."""
    described = pointing_rig(stiffness=None, step=1e-6)
    found = rungs(substitute(described, {"transducer.tilt": np.array([3e-3, -2e-3])}), described)
    assert list(found) == ["masses and CoGs", "tilt", "misalignment"]
    (rms, peak), *rest = found.values()
    assert 0.01 < rms < peak < 0.1
    assert max(one for one, _ in rest) < 0.1 * rms


@pytest.mark.parametrize("known", [True, False])
def test_an_elastic_transducer_needs_its_sag(known: bool) -> None:
    described = pointing_rig(step=1e-6)
    transducer = described.transducer
    assert transducer.stiffness is not None
    if known:  # exactly: the rung frees nothing, but has the sag
        stiff = replace(transducer.stiffness, sigma=np.zeros(3))
        described = replace(described, transducer=replace(transducer, stiffness=stiff))
    found = rungs(described, described)
    assert list(found) == ["masses and CoGs", "tilt", "misalignment", "sag"]
    assert found["misalignment"][0] > 3.0 * found["sag"][0]
    assert found["sag"][0] < 1e-3


def test_the_last_rung_is_the_model_below_a_third_of_its_corner() -> None:
    described = pointing_rig(step=1e-6)
    run = record(described, "calibration", angles(), np.random.default_rng(2), noise=NOISE)
    samples = [gravity.Sample(run.name, motion.estimate(run, described), run.wrench, calibration=True)]
    model = gravity.fit(samples, described, include_inertia=False)
    share = ladder(samples, model)[-1].rms / model.residual_rms["calibration"]
    assert share == pytest.approx(np.full(6, 0.7), abs=0.3)  # of noise sqrt(0.3), of drift all
