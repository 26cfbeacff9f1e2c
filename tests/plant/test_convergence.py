"""What the step and the rotors' friction cost in accuracy, and that a run repeats to the last bit."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from plant_rigs import NOMINAL, streams, two_axis

from engine import TRAJECTORIES
from kbs_process.plant.predict import DEFAULT_STEP
from kbs_process.plant.schedule import Schedule
from kbs_process.signals.records import Array

NOISE = np.array([0.02] * 3 + [0.002] * 3)


def run(name: str, until: float, step: float, **settings: Any) -> dict[str, Array]:
    commands = TRAJECTORIES[name]().until(until)
    schedule = Schedule(commands.t, commands.position, commands.rate)
    return streams(
        two_axis(**settings), NOMINAL, schedule, rate_Hz=100.0, angle_rate_Hz=20.0, duration_s=until, step_s=step,
        quantise=False,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("name", "until", "settings"),
    [
        ("EL089P00", 100.0, {}),
        ("EL089P00", 100.0, {"loop": "closed"}),
        ("EL089P00", 80.0, {"stiffness": None}),
        ("AESING00", 70.0, {}),
        ("AL012M00", 30.0, {}),
    ],
)
def test_halving_the_step_moves_less_than_a_tenth_of_the_noise(
    name: str, until: float, settings: dict[str, Any]
) -> None:
    coarse, fine = (run(name, until, step, **settings) for step in (DEFAULT_STEP, DEFAULT_STEP / 2))
    wrench = np.sqrt(((coarse["wrench"] - fine["wrench"]) ** 2).mean(axis=0)) / NOISE
    angle = np.sqrt(((coarse["angle"] - fine["angle"]) ** 2).mean(axis=0)).max()
    print(
        f"\n{name} {settings}: {1e3 * DEFAULT_STEP} ms against half of it, share of the noise rms:",
        wrench.round(4),
    )
    print(f"  angles {angle:.1e} rad rms")
    assert wrench.max() < 0.1
    assert angle < 1e-6


def test_error_falls_with_the_step() -> None:
    steps = (8e-4, 4e-4, 2e-4, 1e-4)
    runs = [run("EL089P00", 75.0, step)["wrench"] for step in steps]
    changes = [float(np.std(a - b, axis=0)[4]) for a, b in pairwise(runs)]
    print("change of Ty by halving, N m:", changes)
    assert changes[1] < 0.4 * changes[0]
    assert changes[2] < 0.8 * changes[1]  # of first order in the end: a tooth's contact begins within a step


def test_same_input_gives_the_same_bits() -> None:
    first, second = (run("EL089P00", 12.0, DEFAULT_STEP) for _ in range(2))
    for key, values in first.items():
        assert values.tobytes() == second[key].tobytes()


def test_blocks_do_not_show(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = run("EL089P00", 8.0, DEFAULT_STEP, loop="closed")
    monkeypatch.setattr("kbs_process.plant.predict.BLOCK_S", 0.37)
    pieces = run("EL089P00", 8.0, DEFAULT_STEP, loop="closed")
    for key, values in whole.items():
        assert values.tobytes() == pieces[key].tobytes()
