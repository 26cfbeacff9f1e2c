"""Speed of the plant beside hand-written C and MuJoCo, on EL089's slew: simulated seconds a second.

The C loop is what one would write without the package: the same right-hand side, RK4 at 0.1 ms, gcc -O3. Run with
`pytest tests/benchmarks/test_plant.py --benchmark-only -s`.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from pytest_benchmark.fixture import BenchmarkFixture

from engine import TRAJECTORIES, Hardware, simulate
from kbs_process.campaign.load import load_campaign
from kbs_process.plant.effects import select
from kbs_process.plant.predict import DEFAULT_STEP, predict
from kbs_process.plant.schedule import Schedule
from kbs_process.plant.simulation import Simulation
from kbs_process.plant.structure import link_inertia
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array

CAMPAIGN = Path(__file__).parents[2] / "campaigns" / "EL089"
SECONDS = 90.0
RK4_STEP = 1e-4
WIDTH = 0.03  # rad/s, of the regularised sign: narrower makes RK4 unstable at this step
DRIVE = ("Tmax", "Kangle", "tcog", "b_m", "d0", "d1", "w_dyn", "Ts0", "delta")


def timed(work: Callable[[], object], repeats: int = 3) -> float:
    """Least time of some repeats, s."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def test_speed(benchmark: BenchmarkFixture, tmp_path: Path) -> None:
    campaign = load_campaign(CAMPAIGN)
    rig, effects = campaign.rig, campaign.effects
    commands = TRAJECTORIES["EL089P00"]().until(SECONDS + 0.2)
    schedule = Schedule(commands.t, commands.position, commands.rate)
    hardware = Hardware.from_campaign(CAMPAIGN)

    def ours(step: float) -> list[Array]:
        blocks = predict(
            rig, effects, schedule, rate_Hz=100.0, angle_rate_Hz=100.0, duration_s=SECONDS, step_s=step
        )
        return [block.values for key, block in blocks if key == "wrench"]

    wrench = np.concatenate(ours(DEFAULT_STEP))
    speeds = {
        "plant, default step of 0.2 ms": SECONDS / timed(lambda: ours(DEFAULT_STEP)),
        "plant, 0.1 ms": SECONDS / timed(lambda: ours(RK4_STEP)),
        "MuJoCo with its own drives": commands.t[-1] / timed(lambda: simulate(hardware, commands), 1),
    }
    if shutil.which("gcc"):
        by_hand = rk4(tmp_path, rig, effects, schedule)
        np.testing.assert_allclose(by_hand().mean(axis=0), wrench.mean(axis=0), atol=0.01)  # the same plant
        speeds["C, RK4 at 0.1 ms"] = SECONDS / timed(by_hand)
    fastest = speeds["plant, default step of 0.2 ms"]
    print()
    for name, speed in speeds.items():
        print(
            f"{name:32s} {speed:7.1f} simulated s/s   plant at its default is {fastest / speed:5.2f} times that"
        )
    benchmark.extra_info.update(speeds)
    benchmark.pedantic(ours, args=(DEFAULT_STEP,), rounds=1)
    assert fastest > 100.0


def rk4(folder: Path, rig: Rig, effects: tuple[str, ...], schedule: Schedule) -> Callable[[], Array]:
    """Compile the C loop and return what runs it once over the schedule, from the plant's equilibrium."""
    library = folder / "plant_rk4.so"
    source = Path(__file__).with_name("plant_rk4.c")
    subprocess.run(["gcc", "-O3", "-shared", "-fPIC", "-o", library, source, "-lm"], check=True)
    run = ctypes.CDLL(str(library)).run
    pointer = np.ctypeslib.ndpointer(dtype=np.float64, flags="C")
    run.argtypes = [
        pointer, pointer, ctypes.c_long, ctypes.c_double, ctypes.c_double, pointer, ctypes.c_long, pointer,
    ]  # fmt: skip
    drive = rig.joint("el").drive
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
    start = Simulation(
        rig, select(effects), schedule, step=RK4_STEP, per_sample=100, angle_rate=100.0, end=SECONDS
    ).state[:14].copy()  # fmt: skip
    fields = np.ascontiguousarray(100.0 * schedule.position)
    steps = round(SECONDS / RK4_STEP)

    def once() -> Array:
        out = np.empty((steps // 100, 6))
        run(numbers, start.copy(), steps, RK4_STEP, 0.1, fields, 100, out)
        return out

    return once
