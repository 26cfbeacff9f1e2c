"""From files that nobody prepared to a report: timetables, and quaternions in the sections of one log."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

import kbs_process
from kbs_process.studies.convert.begin import begin, check_description
from kbs_process.studies.convert.run import import_recordings
from studies.convert.test_begin import ANSWERS

LATE = 3.724  # s: the wrench's logger was started so much later
MASS, COG, INERTIA = 5.1, (0.123, 0.004), 0.02  # kg; m along and above the arm; kg m^2
RUNS = {
    "sweep": ([0.0, 0.5, 1.1, 0.2, 1.2, 0.7, 0.0], 10.0, 0.0),  # poses, rad; s between two; N m of a buzz
    "test": ([0.1, 0.9, 0.3, 1.2], 16.0, 0.05),
}
MOUNT = Rotation.from_rotvec([0.4, -1.1, 0.8])  # of the inertial unit on the arm


def angle_at(t: np.ndarray, poses: list[float], seconds: float) -> np.ndarray:
    q = np.full_like(t, poses[0])
    for k, (a, b) in enumerate(pairwise(poses)):
        s = np.clip((t - 8.0 - k * (seconds + 4.0)) / seconds, 0.0, 1.0)
        q += (b - a) * (10 * s**3 - 15 * s**4 + 6 * s**5)
    return q


def write_files(folder: Path) -> list[Path]:
    """A timetable with uneven stamps a run, in kN and about other zeros, and one log of an inertial unit's runs."""
    from matio import save_to_mat

    rng = np.random.default_rng(1996)
    log = "Unit 7\n"
    for name, (poses, seconds, buzz) in RUNS.items():
        length = 12.0 + (len(poses) - 1) * (seconds + 4.0)
        even = np.arange(0.0, length, 0.005)
        q = angle_at(even + LATE, poses, seconds)
        x, z = COG[0] * np.cos(q) - COG[1] * np.sin(q), COG[0] * np.sin(q) + COG[1] * np.cos(q) + 0.2
        fx, fz = (-MASS * np.gradient(np.gradient(way, even), even) for way in (x, z))
        fz -= MASS * 9.80665
        ty = z * fx - x * fz + INERTIA * np.gradient(np.gradient(q, even), even)
        ty += buzz * np.sin(np.pi * even) * (even > 40.0)
        none = np.zeros_like(even)
        zeros = np.array([0.4, -0.3, 0.8, 0.02, 0.05, -0.01])
        wrench = np.column_stack([fx, none, fz, none, ty, none]) + zeros
        t = even + rng.uniform(-0.0015, 0.0015, len(even))
        t -= t[0]
        held = np.column_stack([np.interp(t, even, one) for one in wrench.T])
        held += rng.normal(0.0, [0.02] * 3 + [0.002] * 3, held.shape)
        held[:, 2] = -0.001 * held[:, 2] + 1.0  # Fz in kN, the other way round, from a zero of its own
        table = pd.DataFrame(held, columns=["Fx_N", "Fy_N", "Fz_kN", "Mx_Nm", "My_Nm", "Mz_Nm"])
        table.index = pd.Index(pd.to_timedelta(t, unit="s"), name="Time")
        save_to_mat(folder / f"wrench_{name}.mat", {"rig": {"load": table, "serial": 12}})
        t = np.arange(0.0, length, 0.02)
        R = Rotation.from_rotvec(angle_at(t, poses, seconds)[:, None] * [0.0, -1.0, 0.0]) * MOUNT
        numbers = R.as_quat(scalar_first=True) * rng.choice([-1.0, 1.0], (len(t), 1))
        numbers += rng.normal(0.0, 2e-5, numbers.shape)
        rows = (f"{1000 * at:.1f};" + ";".join(f"{x:.6f}" for x in row) for at, row in zip(t, numbers, strict=True))
        log += f"Run {name}\nt_ms;qw;qx;qy;qz\n" + "\n".join(rows) + "\n\nEnd\n"
    (folder / "imu.txt").write_text(log)
    return sorted(folder.glob("*.*"), reverse=True)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_from_timetables_and_a_log_of_quaternions_to_a_report(tmp_path: Path) -> None:
    pytest.importorskip("matio")
    files = write_files(tmp_path)
    lines = list(begin(tmp_path / "arm", [*sorted(files[:2]), files[2]]))
    assert sum("are added to the times of wrench" in line for line in lines) == 2
    zero = [round(float(x), 6) for x in MOUNT.as_quat(scalar_first=True)]
    answers = ANSWERS | {
        "mapping.toml": [
            ('unit = "kN"', 'unit = "kN", scale = -1.0, offset = 1.0'),
            ('maps = "?"', 'maps = "link to base"'),
            ("# at_zero = [...]", f"at_zero = {zero}"),
            ('trajectory = "sweep"', 'role = "calibration"\ntrajectory = "sweep"'),
            ('trajectory = "test"', 'role = "held-out"\ntrajectory = "test"'),
            ('role = "?"', "#"),
        ]
    }
    for name, pairs in answers.items():
        text = (tmp_path / "arm" / name).read_text()
        for old, new in pairs:
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "arm" / name).write_text(text)
    list(check_description(tmp_path / "arm"))
    campaign = import_recordings(tmp_path / "arm" / "mapping.toml", tmp_path, tmp_path / "campaigns" / "arm")
    results = kbs_process.process(campaign, tmp_path / "results")
    fitted = {one.name: one for one in results.gravity.parameters}
    moment = fitted["body.joint.mass"].value * fitted["body.joint.cog[0]"].value
    assert moment == pytest.approx(MASS * COG[0], rel=0.005)
    for name, true in (("mass", MASS), ("cog[2]", COG[1]), ("inertia[1]", INERTIA)):
        found = fitted[f"body.joint.{name}"]
        assert abs(found.value - true) < 3.0 * found.sigma, name
    (requirement,) = results.requirements
    assert (requirement.verdict, requirement.channel) == ("fail", "Ty")
    assert requirement.value == pytest.approx(0.0529, abs=0.003)  # the buzz, and the arm's own acceleration
