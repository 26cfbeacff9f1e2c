"""The generated module: cached on disk, made anew when an effect changes, and whole whoever races for it."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kbs_process.plant.compiled import compile as compiling
from kbs_process.plant.compiled.generate import module_text
from kbs_process.plant.compiled.simulation import Simulation
from kbs_process.plant.effect import Effect, LogNormal, Parameter, Port, State
from kbs_process.plant.laws import CATALOGUE, select
from kbs_process.plant.schedule import Schedule
from kbs_process.plant.structure import Structure
from plant.plant_rigs import DRIVE, body, joint, quantity, rig

pytestmark = pytest.mark.slow

TWO = Structure((-1, 0), True, tuple(effect for effect in CATALOGUE if effect.port.of_drive))
MODULES = [compiling.inspect.getmodule(effect.equation) for effect in TWO.effects]


def relaxing(z: float, rotor_rate: float, strength: float, decay: float) -> tuple[float, float]:
    """A Maxwell element between rotor and carrier: torque -z, dz/dt = strength w - z decay."""
    return -z, strength * rotor_rate - decay * z


MEMORY = Effect(
    "memory",
    Port.MOTOR_TORQUE,
    relaxing,
    (
        Parameter("strength", "N m/rad", LogNormal(2.0, 0.1), "stiffness", (0.0, 100.0)),
        Parameter("decay", "1/s", LogNormal(5.0, 0.1), "inverse of the time it remembers", (0.0, 100.0)),
    ),
    states=(State("z", "N m", 0.0, "torque remembered"),),
)


def test_module_is_readable_python_that_calls_each_effect() -> None:
    text = module_text(TWO)
    compile(text, "plant", "exec")
    for effect in TWO.effects:
        assert (f"= effect_{effect.name}(" in text) is not bool(effect.delay)
    places = [p.name for effect in TWO.effects for p in effect.parameters]
    late = {effect.of_set_points: places.index(effect.delay) for effect in TWO.effects if effect.delay}
    assert f"time - (p[k + {late[False]}])" in text
    assert f"late = p[k + {late[True]}]" in text


def test_file_is_written_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KBS_CACHE", str(tmp_path))
    first = compiling._written("plant_x", "a = 1\n")
    stamp = first.stat().st_mtime_ns
    assert compiling._written("plant_x", "a = 1\n") == first
    assert first.stat().st_mtime_ns == stamp  # else the machine code beside it would be void
    assert [path.name for path in tmp_path.iterdir()] == ["plant_x.py"]


def test_a_damaged_file_is_written_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KBS_CACHE", str(tmp_path))
    path = Path(str(compiling.compiled_module("test", "WHOLE = 42\n", []).__file__))
    for damage in (b"", b"\xff\xfe\0" * 100):
        path.write_bytes(damage)
        del sys.modules[path.stem]
        assert compiling.compiled_module("test", "WHOLE = 42\n", []).WHOLE == 42


def test_a_folder_that_cannot_be_written_is_done_without(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("not a folder")
    monkeypatch.setenv("KBS_CACHE", str(tmp_path / "file" / "below"))
    path = compiling._written("plant_x", "a = 1\n")
    assert path.read_text() == "a = 1\n"


def test_edited_equation_gets_another_file(monkeypatch: pytest.MonkeyPatch) -> None:
    text = module_text(TWO)
    before = compiling._fingerprint(text, MODULES)
    source = compiling.inspect.getsource
    monkeypatch.setattr(
        compiling.inspect,
        "getsource",
        lambda module: source(module).replace("200.0 * rotor_angle", "201.0 * rotor_angle"),
    )
    assert compiling._fingerprint(text, MODULES) != before


RACE = """
import numpy as np
from kbs_process.plant.compiled.compile import compiled_plant
from kbs_process.plant.laws import select
from kbs_process.plant.structure import Structure
plant = compiled_plant(Structure((-1,), False, select(["synchronous_motor", "flexspline"])))
print(plant.path.name)
"""


def test_processes_may_race(tmp_path: Path) -> None:
    racers = [
        subprocess.Popen(
            [sys.executable, "-c", RACE], env={"KBS_CACHE": str(tmp_path)}, stdout=subprocess.PIPE, text=True
        )
        for _ in range(2)
    ]
    names = {racer.communicate()[0].strip() for racer in racers}
    assert all(racer.returncode == 0 for racer in racers)
    assert len(names) == 1
    assert not list(tmp_path.glob("*.tmp"))


def test_effect_with_a_state_is_integrated() -> None:
    """A relaxation torque beside the motor: the rotor's position shows the memory fade at its rate."""
    effects = (*select(["synchronous_motor", "flexspline"]), MEMORY)
    bodies = (body("load", "tip", 1.0, (0.0, 0.0, 0.0), (10.0, 10.0, 10.0)),)
    tip = joint("tip", "T", (0.0, 0.0, 1.0), (0.0, 0.0, 0.1), **DRIVE | {"fsv": 300.0, "Ka": 1e3})
    extra = {name: quantity(f"p.{name}", value) for name, value in (("strength", 2.0), ("decay", 5.0))}
    tip = replace(tip, drive=replace(tip.drive, parameters=tip.drive.parameters | extra))
    of = rig(bodies, (tip,), gravity=0.0, stiffness=None, amplifier=None)
    still = Schedule(np.array([0.0, 0.1]), np.zeros((2, 1)), np.zeros((2, 1)))
    made = Simulation(of, effects, still, step=1e-4, per_sample=100, angle_rate=1.0, end=1.0)
    made.part("z")[:] = 0.01
    memory = [0.01]
    for _ in range(30):
        made.advance(100, 1)
        memory.append(made.part("z")[0])
    # The rotor yields by z / k, which gives (1 + strength / k) dz/dt = -decay z, with k = Tmax Kangle.
    rate = -np.polyfit(0.01 * np.arange(10, 31), np.log(memory[10:]), 1)[0]
    expected = 5.0 / (1.0 + 2.0 / 35.0)
    print(f"memory fades at {rate:.4f} 1/s, expected {expected:.4f} 1/s")
    assert rate == pytest.approx(expected, rel=0.01)
