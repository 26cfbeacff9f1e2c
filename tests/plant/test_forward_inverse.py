"""Forward and inverse dynamics of the package against each other, step by step."""

from __future__ import annotations

import numpy as np
import pytest

from kbs_process.plant.compiled.simulation import Simulation
from kbs_process.plant.laws import select
from kbs_process.plant.rigid import inverse_dynamics
from kbs_process.plant.schedule import Schedule
from plant import energetics as lab
from plant.plant_rigs import NOMINAL, two_axis

pytestmark = pytest.mark.slow


def test_inverse_dynamics_of_a_step_give_its_wrench() -> None:
    """On a rigid transducer; the rotors' own spin, which inverse dynamics takes from the joints, is put right."""
    of = two_axis(stiffness=None, amplifier=None, tilt=(4e-3, -6e-3), misalignment=(0.02, 0.01, -0.03))
    step, rate = 1e-4, np.radians([5.0, -8.0])
    t = np.arange(0.0, 2.0, 0.1)
    schedule = Schedule(t, np.array([0.3, 0.5]) + np.outer(t, rate), np.tile(rate, (len(t), 1)))
    made = Simulation(of, select(NOMINAL), schedule, step=step, per_sample=1, angle_rate=1.0, end=1.0)
    made.advance(2000, 1)
    errors, size = [], []
    for _ in range(50):
        q, qd, spin = (made.part(name).copy() for name in ("q", "qd", "spin"))
        made.advance(1, 1)
        middle, rates, qdd = q + 0.5 * step * qd, 0.5 * (qd + made.part("qd")), made.part("qdd").copy()
        expected = inverse_dynamics(of, middle[None], rates[None], qdd[None])[0]
        coordinates, still = np.concatenate([np.zeros(3), middle]), np.concatenate([np.zeros(3), rates])
        for i, joint in enumerate(of.joints):
            axis = lab.axes(of, coordinates)[i]
            carrier = lab.angular(of, joint.parent, coordinates, still)
            ahead, behind = (
                lab.angular(of, joint.parent, coordinates + s * 1e-4 * still, still + s * 1e-4 * np.r_[0, 0, 0, qdd])
                for s in (1, -1)
            )
            turning = axis @ (ahead - behind) / 2e-4
            taken = 2e-5 * np.array([axis @ carrier + 100.0 * rates[i], turning + 100.0 * qdd[i]])
            true = 2e-5 * np.array([0.5 * (spin[i] + made.part("spin")[i]), (made.part("spin")[i] - spin[i]) / step])
            spin_momentum, change = true - taken
            expected[3:] -= change * axis + spin_momentum * np.cross(carrier, axis)
        errors.append(made.wrench - expected)
        size.append(expected)
    print("forward against inverse dynamics, greatest:", np.abs(errors).max(axis=0), "of", np.std(size, axis=0))
    assert np.abs(errors).max() < 1e-5
    assert np.std(size, axis=0).min() > 1e-3
