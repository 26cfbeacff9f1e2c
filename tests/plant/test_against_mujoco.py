"""The plant against an independent engine: MuJoCo's rigid bodies with their own drives and controller."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from engine import TRAJECTORIES, Hardware, simulate
from kbs_process.plant.schedule import Schedule
from kbs_process.signals.records import Array
from plant.plant_rigs import NOMINAL, streams, two_axis

pytestmark = pytest.mark.slow

CAMPAIGN = Path(__file__).parents[2] / "campaigns" / "EL089"
NOISE = np.array([0.02] * 3 + [0.002] * 3)  # rms a sample at 100 Hz
CODE = 2.0 * np.pi / 2**14

CASES = {
    "EL089, open loop": ("EL089P00", 90.0, {}),
    "EL089, closed loop": ("EL089P00", 75.0, {"loop": "closed"}),
    "singularity, open loop": ("AESING00", 105.0, {}),
    "singularity, closed loop": ("AESING00", 50.0, {"loop": "closed", "latency": 2}),
    "azimuth at 2 deg/s": ("AL012M00", 30.0, {}),
    "tilted and misaligned": (
        "AESING00",
        20.0,
        {"transducer.tilt": [4e-3, -3e-3], "joint.el.misalignment": [2e-3, 0.0, -3e-3]},
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_wrench_and_angles_agree(case: str) -> None:
    name, until, changes = CASES[case]
    commands = TRAJECTORIES[name]().until(until)
    theirs = simulate(Hardware.from_campaign(CAMPAIGN).with_values(changes), commands, rate_hz=100.0)
    settings: dict[str, Any] = {key.rpartition(".")[2]: value for key, value in changes.items()}
    ours = streams(
        two_axis(**settings),
        NOMINAL,
        Schedule(commands.t, commands.position, commands.rate),
        rate_Hz=100.0,
        angle_rate_Hz=100.0,
        duration_s=until,
        quantise=False,
    )
    n = len(ours["wrench"])
    wrench = (ours["wrench"] - theirs.wrench[:n]) / NOISE
    angle = (ours["angle"] - theirs.angles[:n]) / CODE
    field = ours["field"] - theirs.field[: len(ours["field"])]
    print(f"\n{case}: difference over {until:.0f} s, in sensor noise rms and encoder codes")
    print("  wrench rms", _percent(wrench.std(axis=0)), " greatest", _percent(np.abs(wrench).max(axis=0)))
    print("  angles rms", _percent(angle.std(axis=0)), " greatest", _percent(np.abs(angle).max(axis=0)))
    assert np.sqrt((wrench**2).mean(axis=0)).max() < 0.1
    assert np.abs(wrench).max() < 0.75
    assert np.abs(angle).max() < 0.01
    assert np.abs(field).max() < 1e-6
    assert (theirs.wrench.std(axis=0) / NOISE).max() > 1.0  # the trajectory shows something


def _percent(values: Array) -> str:
    return " ".join(f"{100 * value:.2f} %" for value in values)
