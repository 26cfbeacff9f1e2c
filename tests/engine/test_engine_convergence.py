"""Halving the integrator's step moves no channel by a tenth of its sensor noise, rms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from engine import Commands, Hardware, simulate
from engine.simulation import TIME_STEP
from engine.trajectories import Axis, commands

pytestmark = pytest.mark.slow

CAMPAIGN = Path(__file__).parents[2] / "campaigns" / "EL089"

# Through tooth-passing resonances; close to the singularity, both axes; quick azimuth.
PATHS = {
    "elevation ramp": commands(Axis(0.0), Axis(70.0).rest(1.0).accelerate(0.3), 20.0),
    "both axes": commands(Axis(-20.0).accelerate(0.3).rest(5.0), Axis(88.0).accelerate(0.06), 20.0),
    "quick azimuth": commands(Axis(-20.0).accelerate(2.0, 0.25), Axis(80.0), 12.0),
}


@pytest.mark.parametrize("path", PATHS.values(), ids=PATHS)
def test_halving_the_step(path: Commands) -> None:
    hardware = Hardware.from_campaign(CAMPAIGN, seed=3)
    coarse, fine = (simulate(hardware, path, time_step=step) for step in (TIME_STEP, TIME_STEP / 2))
    change = np.sqrt(np.mean((coarse.wrench - fine.wrench) ** 2, axis=0))
    assert np.all(change < 0.1 * hardware["transducer.noise"]), change / hardware["transducer.noise"]
    code = hardware.scalar("joint.el.encoder.step")
    turn = np.sqrt(np.mean((coarse.angles - fine.angles) ** 2, axis=0))
    assert np.all(turn < 0.1 * code / np.sqrt(12.0)), turn
