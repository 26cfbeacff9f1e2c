"""Speed of the plant beside hand-written C and MuJoCo, on EL089's slew: simulated seconds a second, in one run.

The C loop is what one would write without the package: the same right-hand side, RK4 at 0.1 ms, gcc at its
fastest. Run with `pytest tests/benchmarks/test_plant.py --benchmark-only -s`.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from benchmarks.plant_rk4 import compiled_rk4
from engine import TRAJECTORIES, Hardware, simulate
from kbs_process.campaign.load import load_campaign
from kbs_process.plant.compiled.simulation import Simulation
from kbs_process.plant.laws import select
from kbs_process.plant.predict import DEFAULT_STEP, LANES, predict, predict_together, simulation_of
from kbs_process.plant.schedule import Schedule
from kbs_process.plant.structure import link_inertia
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array

pytestmark = pytest.mark.slow

CAMPAIGN = Path(__file__).parents[2] / "campaigns" / "EL089"
SECONDS = 90.0
RK4_STEP = 1e-4
WIDTH = 0.03  # rad/s, of the regularised sign: narrower makes RK4 unstable at this step
DRIVE = ("Tmax", "Kangle", "tcog", "b_m", "d0", "d1", "w_dyn", "Ts0", "delta")
FLAGS = ("-O3", "-march=native", "-ffast-math")


def test_speed(benchmark: BenchmarkFixture, tmp_path: Path) -> None:
    if shutil.which("gcc") is None:
        pytest.skip("needs gcc")
    campaign = load_campaign(CAMPAIGN)
    rig, effects = campaign.rig, campaign.effects
    assert rig.controller is not None
    loops = {name: replace(rig, controller=replace(rig.controller, loop=name)) for name in ("open", "closed")}
    commands = TRAJECTORIES["EL089P00"]().until(SECONDS + 0.2)
    schedule = Schedule(commands.t, commands.position, commands.rate)
    hardware = Hardware.from_campaign(CAMPAIGN)

    def plant(loop: str = "open", step: float = DEFAULT_STEP) -> Array:
        blocks = predict(
            loops[loop], effects, schedule, rate_Hz=100.0, angle_rate_Hz=100.0, duration_s=SECONDS, step_s=step
        )
        return np.concatenate([block.values for key, block in blocks if key == "wrench"])

    def side_by_side() -> Array:
        rates = {"rate_Hz": 100.0, "angle_rate_Hz": 100.0, "duration_s": SECONDS}
        begun = [simulation_of(loops["open"], effects, schedule, **rates) for _ in range(LANES)]
        return predict_together(begun, 100.0, SECONDS)[0][0]

    in_c, in_numba = rk4(tmp_path, rig, effects, schedule)
    wrench = plant()
    np.testing.assert_allclose(side_by_side(), wrench, atol=1e-6)
    by_hand, generated = in_c(), in_numba()
    np.testing.assert_allclose(by_hand.mean(axis=0), wrench.mean(axis=0), atol=0.01)  # the same plant
    np.testing.assert_allclose(by_hand[:1000], generated[:1000], atol=1e-4)
    ways: dict[str, Callable[[], object]] = {
        "plant, 2 ms, open loop": plant,
        "plant, 2 ms, closed loop": lambda: plant("closed"),
        f"{LANES} plants side by side": side_by_side,
        "plant, 1 ms": lambda: plant(step=DEFAULT_STEP / 2),
        "RK4 0.1 ms, generated plant": in_numba,
        "RK4 0.1 ms, C by hand": in_c,
    }
    times = least_times(ways)
    start = time.perf_counter()
    simulate(hardware, commands)
    times["MuJoCo implicit, its own drives"] = time.perf_counter() - start
    reference = times["plant, 2 ms, open loop"]
    print()
    for name, taken in times.items():
        print(f"{name:32s} {SECONDS / taken:7.1f} simulated s/s   the plant is {taken / reference:6.2f} times as fast")
    ratio = times["RK4 0.1 ms, C by hand"] / times["RK4 0.1 ms, generated plant"]
    print(f"RK4, generated plant against C: {ratio:.2f}")
    gain = LANES * reference / times[f"{LANES} plants side by side"]
    print(f"{LANES} plants side by side against one after the other: {gain:.2f} times as fast")
    benchmark.extra_info.update({name: SECONDS / taken for name, taken in times.items()})
    benchmark.pedantic(plant, rounds=1)
    assert times["RK4 0.1 ms, C by hand"] > 8.0 * reference
    assert ratio > 0.8
    assert gain > 2.0


def least_times(ways: dict[str, Callable[[], object]], rounds: int = 5) -> dict[str, float]:
    """Least time of each way, s; taken in turns, so that what else the machine does hits all of them."""
    times = dict.fromkeys(ways, np.inf)
    for _ in range(rounds):
        for name, work in ways.items():
            start = time.perf_counter()
            work()
            times[name] = min(times[name], time.perf_counter() - start)
    return times


def rk4(
    folder: Path, rig: Rig, effects: tuple[str, ...], schedule: Schedule
) -> tuple[Callable[[], Array], Callable[[], Array]]:
    """Return what runs the schedule once from the plant's equilibrium: the loop in C, the generated plant's."""
    library = folder / "plant_rk4.so"
    source = Path(__file__).with_name("plant_rk4.c")
    subprocess.run(["gcc", *FLAGS, "-shared", "-fPIC", "-o", library, source, "-lm"], check=True)
    run = ctypes.CDLL(str(library)).run
    pointer = np.ctypeslib.ndpointer(dtype=np.float64, flags="C")
    run.argtypes = [
        pointer, pointer, ctypes.c_long, ctypes.c_double, ctypes.c_double, pointer, ctypes.c_long, pointer,
    ]  # fmt: skip
    drive = rig.joint("el").drive
    assert drive is not None
    value = {name: float(quantity) for name, quantity in drive.parameters.items()}
    numbers = np.concatenate(
        [
            [float(rig.gravity)],
            rig.transducer.stiffness.value,
            rig.transducer.damping.value,
            [rig.joint("az").origin.value[2]],
            *[link_inertia([body for body in rig.bodies if body.on == link]) for link in ("T", "az", "el")],
            [float(drive.rotor_inertia), float(drive.ratio)],
            [value[name] for name in DRIVE],
            [WIDTH, value["fsv"], value["Ka"]],
        ]
    )
    simulation = Simulation(
        rig, select(effects), schedule, step=RK4_STEP, per_sample=100, angle_rate=100.0, end=SECONDS
    )
    start = simulation.state[:14].copy()
    generated = compiled_rk4(simulation.structure, folder)
    fields = np.ascontiguousarray(100.0 * schedule.position)
    microsteps = fields * simulation.microsteps
    steps = round(SECONDS / RK4_STEP)

    def in_c() -> Array:
        out = np.empty((steps // 100, 6))
        run(numbers, start.copy(), steps, RK4_STEP, 0.1, fields, 100, out)
        return out

    def in_numba() -> Array:
        out = np.empty((steps // 100, 6))
        generated(simulation.p, start.copy(), steps, RK4_STEP, 0.1, microsteps, 100, WIDTH, out)
        return out

    return in_c, in_numba
