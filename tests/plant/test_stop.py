"""A stop on request, and before a range ends: against the independent engine's own, and by closed form."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.csv
import pyarrow.parquet
import pytest
from pyarrow import table

import archived
from engine import TRAJECTORIES
from kbs_process.campaign.load import load_campaign
from kbs_process.errors import SimulationError
from kbs_process.plant.schedule import Schedule, stopped
from kbs_process.progress import SilentProgress
from kbs_process.rig.model import Controller
from kbs_process.studies.predict.run import simulate_commands

ALLOWED = np.radians(0.015)  # rad/s^2


def controller() -> Controller:
    found = archived.rig("EL089_1996").controller
    assert found is not None
    return found


def commands(name: str) -> Schedule:
    path = TRAJECTORIES[name]()
    return Schedule(path.t, path.position, path.rate)


@pytest.mark.parametrize(("whole", "cut", "at"), [("EL089P00", "ELSTPP00", 98.0), ("AESING00", "AESTPP00", 70.0)])
def test_a_requested_stop_is_the_engines(whole: str, cut: str, at: float) -> None:
    ours, theirs = stopped(commands(whole), controller(), at), commands(cut)
    n = len(theirs.t)
    np.testing.assert_allclose(ours.rate[:n], theirs.rate, atol=1e-7)
    np.testing.assert_allclose(ours.position[:n], theirs.position, atol=2e-6)  # the engine's words are fixed-point
    np.testing.assert_array_equal(ours.rate[-1], 0.0)


def test_a_joint_stops_within_its_range_and_no_sooner_than_it_must() -> None:
    t = 0.1 * np.arange(2000)
    rate = np.minimum(t, 60.0) * ALLOWED
    azimuth = np.radians(120.0) + np.concatenate([[0.0], np.cumsum(0.05 * (rate[1:] + rate[:-1]))])
    made = stopped(
        Schedule(t, np.stack([azimuth, 0.0 * t], axis=1), np.stack([rate, 0.0 * t], axis=1)), controller(), np.inf
    )
    end = np.degrees(made.position[-1, 0])
    assert 165.0 - 2.0 * 0.1 * 0.9 < end <= 165.0  # a cycle at 0.9 deg/s, and what it gains in it
    assert np.abs(np.diff(made.rate, axis=0)).max() <= 0.1 * ALLOWED * (1.0 + 1e-9)
    np.testing.assert_array_equal(made.position[:, 1], 0.0)


def test_what_stays_within_the_range_is_left_alone() -> None:
    path = commands("EL089P00")
    np.testing.assert_array_equal(stopped(path, controller(), np.inf).position, path.position)


def test_a_request_that_is_no_time_stops_at_once() -> None:
    made = stopped(commands("EL089P00"), controller(), np.nan)
    np.testing.assert_array_equal(made.position, np.tile(made.position[0], (len(made.t), 1)))


def test_a_stop_needs_an_acceleration() -> None:
    with pytest.raises(SimulationError, match="nothing says how fast"):
        stopped(commands("EL089P00"), replace(controller(), acceleration=None), 5.0)


def test_simulate_stops(tmp_path: Path) -> None:
    folder = shutil.copytree(archived.CAMPAIGNS / "EL089_1996", tmp_path / "C", ignore=shutil.ignore_patterns("*.mcap"))
    for name in re.findall(r'file = "(.*?)"', (folder / "campaign.toml").read_text()):
        (folder / name).touch()
    t = np.arange(0.0, 12.0, 0.1)
    rate = np.minimum(t, 4.0) * ALLOWED
    way = np.concatenate([[0.0], np.cumsum(0.05 * (rate[1:] + rate[:-1]))])
    pyarrow.csv.write_csv(table({"t": t, "az": way, "el": 1.3 + 0.0 * t}), tmp_path / "slew.csv")
    simulate_commands(
        load_campaign(folder, checksums=False), tmp_path / "slew.csv", tmp_path / "made",
        rate_Hz=20.0, progress=SilentProgress(), stop=5.0,
    )  # fmt: skip
    angle = pyarrow.parquet.read_table(tmp_path / "made" / "angle.parquet")["az"].to_numpy()
    rest = ALLOWED * (0.5 * 4.0**2 + 4.0 * 1.0 + 0.5 * 4.0**2)  # sped up, coasted until the request, braked
    assert angle[-1] == pytest.approx(rest, abs=6e-4)  # a code, and the gear
