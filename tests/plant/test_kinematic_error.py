"""The gear's error of twice a motor turn: energy, the independent engine, and where it shows beside the paper's d1."""

from __future__ import annotations

import re
import shutil
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from engine import TRAJECTORIES, Hardware, simulate
from engine.drive import drive_numbers
from engine.trajectories import Axis, commands
from kbs_process.campaign.load import load_campaign
from kbs_process.plant.attach import attach
from kbs_process.plant.compiled.simulation import Simulation
from kbs_process.plant.laws import select
from kbs_process.plant.laws.gear.kinematic_error import KINEMATIC_ERROR
from kbs_process.plant.linear.linearise import drive_slopes
from kbs_process.plant.schedule import Schedule
from kbs_process.rig.model import Rig
from plant import energetics as lab
from plant.plant_rigs import NOMINAL, streams, two_axis
from plant.test_against_mujoco import CODE, NOISE
from plant.test_balances import FREE, standing, with_drive

pytestmark = pytest.mark.slow

EFFECTS = (*NOMINAL, "kinematic_error")
CAMPAIGN = Path(__file__).parents[2] / "campaigns" / "EL089"
AMPLITUDE = 1.5e-4  # rad: 1 arcmin from peak to peak


def erring(of: Rig, sine: float, cosine: float) -> Rig:
    values = {"kinematic_sin": sine, "kinematic_cos": cosine, "kinematic_order": 2.0}
    return attach(of, KINEMATIC_ERROR, values, joints=[joint.name for joint in of.joints])


def energy_error(step: float) -> float:
    """Greatest error of total energy over 0.5 s of a swing through half a motor turn, as a share of what is moved."""
    of = erring(with_drive(two_axis(damping=(0.0, 0.0, 0.0), amplifier=None), **FREE | {"tcog": 0.0}), 3e-3, 2e-3)
    made = Simulation(
        of, select(EFFECTS), standing(np.array([0.2, 0.7])), step=step, per_sample=1, angle_rate=1.0, end=5.0
    )
    made.p[made.p == 0.35] = 0.0  # no field: the loads turn the rotors
    without = with_drive(of, Tmax=0.0)
    first = sum(lab.energy(without, lab.motion(without, made), np.zeros(2)))
    worst, kinetic = 0.0, 0.0
    for _ in range(20):
        made.advance(round(0.025 / step), 1)
        now = lab.energy(without, lab.motion(without, made), np.zeros(2))
        worst, kinetic = max(worst, abs(sum(now) - first)), max(kinetic, now[0])
    return worst / kinetic


def test_energy_is_conserved() -> None:
    coarse, fine = energy_error(2e-4), energy_error(1e-4)
    print(f"energy error, share of the greatest kinetic energy: {coarse:.1e} at 0.2 ms, {fine:.1e} at 0.1 ms")
    assert fine < 1e-3
    assert fine < 0.35 * coarse  # second order


def test_without_amplitude_nothing_changes() -> None:
    t = np.arange(0.0, 5.1, 0.1)
    position = np.outer(0.02 * t, np.ones(2)) + np.array([0.0, 1.0])
    path = Schedule(t, position, np.full_like(position, 0.02))
    rates = {"rate_Hz": 50.0, "angle_rate_Hz": 50.0, "duration_s": 5.0}
    without, none = (
        streams(two_axis(), NOMINAL, path, **rates),
        streams(erring(two_axis(), 0.0, 0.0), EFFECTS, path, **rates),
    )
    np.testing.assert_allclose(none["wrench"], without["wrench"], atol=1e-7)
    np.testing.assert_array_equal(none["angle"], without["angle"])


def test_linearised_gear_has_a_potential() -> None:
    joint, _ = erring(two_axis(), 3e-3, 2e-3).joints
    assert joint.drive is not None
    stiffness, _, _ = drive_slopes(joint.drive, select(EFFECTS), {"rotor_angle": 0.4, "joint_angle": 0.006})
    assert stiffness[0, 1] == pytest.approx(stiffness[1, 0], rel=1e-6)


def test_wrench_and_angles_agree_with_the_engine() -> None:
    """Ten times a catalogue's error, so that what the rotor bears shows at the encoder."""
    path = TRAJECTORIES["AESING00"]().until(40.0)
    changes = {"kinematic_sin": 1.2e-3, "kinematic_cos": -0.9e-3, "kinematic_order": 2.0}
    hardware = Hardware.from_campaign(CAMPAIGN)
    named = {f"joint.{axis}.drive.{key}": np.asarray(value) for axis in ("az", "el") for key, value in changes.items()}
    theirs = simulate(hardware.having(named), path, rate_hz=100.0)
    ours = streams(
        erring(two_axis(), 1.2e-3, -0.9e-3), EFFECTS, Schedule(path.t, path.position, path.rate),
        rate_Hz=100.0, angle_rate_Hz=100.0, duration_s=40.0, quantise=False,
    )  # fmt: skip
    n = len(ours["wrench"])
    wrench = np.sqrt(np.mean(((ours["wrench"] - theirs.wrench[:n]) / NOISE) ** 2, axis=0))
    angle = np.abs(ours["angle"] - theirs.angles[:n]).max() / CODE
    print("wrench, noise", wrench, "angles, codes", angle)
    assert wrench.max() < 0.1
    assert angle < 0.01


def test_a_drive_file_states_it_for_the_plant_and_for_the_engine(tmp_path: Path) -> None:
    folder = shutil.copytree(CAMPAIGN, tmp_path / "EL089", ignore=shutil.ignore_patterns("*.mcap"))
    description, drives = folder / "campaign.toml", folder / "parameters" / "drives.toml"
    description.write_text(description.read_text().replace('"flexspline",', '"flexspline", "kinematic_error",'))
    stated = "\n".join(
        f'{name} = {{ value = {value}, unit = "{unit}", sigma = {sigma}, source = "catalogue" }}'
        for name, value, unit, sigma in (
            ("kinematic_sin", 1.5e-4, "rad", 1.5e-4),
            ("kinematic_cos", 0.0, "rad", 1.5e-4),
            ("kinematic_order", 2, "1", 0),
        )
    )
    drives.write_text(re.sub(r"(?m)^Ka = .*$", lambda line: f"{line[0]}\n{stated}", drives.read_text()))
    for file in tomllib.loads(description.read_text())["recording"]:
        (folder / file["file"]).touch()
    campaign = load_campaign(folder, checksums=False)
    assert campaign.effects[-1] == "kinematic_error"
    assert float(campaign.rig.quantities()["joint.el.drive.kinematic_cos"].sigma) == 1.5e-4
    numbers = drive_numbers(Hardware.from_campaign(folder), "el")
    assert (numbers.kinematic_sin, numbers.kinematic_order) == (AMPLITUDE, 2.0)
    assert drive_numbers(Hardware.from_campaign(folder, seed=1), "el").kinematic_cos != 0.0


def torque_at(rate: float, of: Rig, effects: tuple[str, ...]) -> tuple[float, float]:
    """Frequency (Hz) and amplitude (N m) of the greatest line of Tz from 0.2 to 1.2 Hz; azimuth at `rate`, deg/s."""
    ramp, length = Axis(0.0).accelerate(rate, 2.0).rest(20.0), 36.0 / rate  # ten turns of the motor
    path = commands(ramp.rest(length), Axis(80.0), ramp.duration() + length)
    shown: Any = streams(
        of, effects, Schedule(path.t, path.position, path.rate),
        rate_Hz=50.0, angle_rate_Hz=50.0, duration_s=float(path.t[-1]), quantise=False,
    )["wrench"][-round(50.0 * length) :, 5]  # fmt: skip
    line = 2.0 * np.abs(np.fft.rfft(shown - shown.mean())) / len(shown)
    f = np.fft.rfftfreq(len(shown), 0.02)
    line[(f < 0.2) | (f > 1.2)] = 0.0
    return float(f[np.argmax(line)]), float(line.max())


@pytest.mark.parametrize("rate", [0.6, 1.2, 1.8])
def test_it_shows_in_the_band_and_the_resistance_twice_a_turn_does_not(rate: float) -> None:
    with_error = torque_at(rate, erring(two_axis(), AMPLITUDE, 0.0), EFFECTS)
    resistance = [torque_at(rate, two_axis(drive={"d1": d1}), NOMINAL) for d1 in (0.0, 0.012)]
    print(f"{rate} deg/s: error {with_error}, d1 none and double {resistance}")
    assert with_error[0] == pytest.approx(0.556 * rate, abs=1.0 / (36.0 / rate))
    assert max(line for _, line in resistance) < 0.04 * with_error[1]
