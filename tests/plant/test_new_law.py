"""A new law is one file: laid into a copy of the package, it is found, documented, compiled and screened."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from shutil import copytree, ignore_patterns

import numpy as np
import pytest

import kbs_process

LAW = '''"""Friction of the rotor that grows with the square of its rate: a fan on the motor."""

from __future__ import annotations

from kbs_process.plant.effect import Effect, Normal, Port, amplitude


def torque(rotor_rate: float, fan: float) -> float:
    r"""Torque on the rotor by a fan.

    Equation: $T = -f |\\\\omega_r| \\\\omega_r$.
    Units: rad/s, N m s^2/rad^2 -> N m.
    Validity: turbulent flow.
    Source: S. F. Hoerner, Fluid-Dynamic Drag (1965), chapter 3.
    """
    return -fan * abs(rotor_rate) * rotor_rate


FAN = Effect(
    "fan",
    Port.MOTOR_TORQUE,
    torque,
    (amplitude("fan", "N m s^2/rad^2", Normal(0.0, 1e-3), "drag of the fan", (0.0, 1.0)),),
    passive=True,
    family="viscous",
)
'''

USE = """
import json
import numpy as np
from plant.plant_rigs import NOMINAL, one_axis, streams

import kbs_process
from kbs_process.diagnosis.screening.ranges import Ranges
from kbs_process.diagnosis.screening.suspects import candidates
from kbs_process.plant.attach import attach
from kbs_process.plant.laws import CATALOGUE, find
from kbs_process.plant.laws.document import catalogue
from kbs_process.plant.schedule import Schedule
from kbs_process.plant.compiled.taps import tap_columns

law = find("fan")
rig = one_axis()
t = np.linspace(0.0, 1.0, 11)
turning = Schedule(t, 0.1 * t[:, None] ** 2, 0.2 * t[:, None])
settings = {"rate_Hz": 50.0, "angle_rate_Hz": 50.0, "duration_s": 1.0}
wrenches = [
    streams(attach(rig, law, {"fan": size}), (*NOMINAL, "fan"), turning, **settings)["wrench"].tolist()
    for size in (0.0, 5e-4)
]
suspects = candidates(rig, NOMINAL, Ranges({}), tap_columns(rig), ("tip",))
print(json.dumps({
    "package": kbs_process.__file__,
    "order": [effect.name for effect in CATALOGUE],
    "page": catalogue(),
    "wrenches": wrenches,
    "suspects": [(one.name, one.site) for one in suspects if one.effect is law],
}))
"""


@pytest.mark.slow
def test_a_new_law_is_one_file(tmp_path: Path) -> None:
    package = Path(kbs_process.__file__).parent
    copy = copytree(package, tmp_path / "kbs_process", ignore=ignore_patterns("__pycache__"))
    (copy / "plant" / "laws" / "friction" / "fan.py").write_text(LAW)
    paths = os.pathsep.join([str(tmp_path), str(Path(__file__).parents[1])])
    run = subprocess.run(
        [sys.executable, "-c", USE],
        env=os.environ | {"PYTHONPATH": paths, "KBS_CACHE": str(tmp_path / "cache")},
        capture_output=True,
        text=True,
        check=True,
    )
    told = json.loads(run.stdout)
    assert told["package"].startswith(str(tmp_path))
    assert told["order"][-1] == "fan"  # no order is declared: it comes after all that declare one
    assert "#### `fan`\n\nAt: motor torque; family: viscous." in told["page"]
    assert "| `fan` | N m s^2/rad^2 | drag of the fan | N(0, 0.001) | 0 to 1 | amplitude |" in told["page"]
    without, with_fan = (np.array(wrench) for wrench in told["wrenches"])
    assert 1e-6 < np.max(np.abs(with_fan - without)) < 1.0  # N, N m
    assert told["suspects"] == [["fan", "tip"]]
