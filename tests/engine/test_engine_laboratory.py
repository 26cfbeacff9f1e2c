"""A laboratory's noise: its densities, where it acts, and that it is the same for the same seed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import welch

from engine.hardware import Array, Hardware
from engine.laboratory import GRAVITY, MAINS_HZ, Laboratory
from engine.ports import AT_REST, BY_FLOOR, BY_JOINTS, BY_ROTORS, DISTURBANCE_STEP, NONE
from engine.simulation import Result, simulate
from engine.trajectories import Axis, Commands, commands

pytestmark = pytest.mark.slow

HARDWARE = Hardware.from_campaign(Path(__file__).parents[2] / "campaigns" / "EL089", seed=3)
STILL = commands(Axis(0.0), Axis(70.0), 12.0)
NOISY = Laboratory(floor=4e-4, tilt=3e-6, joints=2e-3, motors=5e-5, mains=0.1)


def pushed(columns: slice, values: tuple[float, ...], path: Commands = STILL) -> Result:
    """What a disturbance that is constant after a second, by which the rig hardly rings, does."""
    t = DISTURBANCE_STEP * np.arange(round(path.t[-1] / DISTURBANCE_STEP) + 2)
    disturbance = np.zeros((len(t), 7))
    disturbance[:, columns] = np.minimum(t / 2.0, 1.0)[:, None] * np.array(values)
    return simulate(HARDWARE, path, extra=replace(NONE, disturbance=disturbance))


def late(values: Array) -> Array:
    """The mean of the last seconds."""
    return np.asarray(values[-500:].mean(axis=0))


def test_densities_are_as_stated() -> None:
    made = NOISY.disturbance(1500.0, np.random.default_rng(2))
    f, S = welch(made, 1 / DISTURBANCE_STEP, nperseg=2**15, axis=0)
    density = np.sqrt(S)

    def seen(column: int, low: float, high: float) -> float:
        return float(density[(f > low) & (f < high), column].mean())

    for column in range(3):
        assert seen(column, 5.8, 6.2) == pytest.approx(4e-4, rel=0.05)
        assert seen(column, 19.0, 21.0) == pytest.approx(4e-4 * 20 / 6, rel=0.05)
    assert seen(2, 0.2, 0.9) == pytest.approx(4e-4 / 6, rel=0.05)
    for column in (3, 4):
        assert seen(column, 2.0, 20.0) == pytest.approx(2e-3, rel=0.03)
        assert seen(column, 100.0, 200.0) < 2e-4
    for column in (5, 6):
        assert seen(column, 2.0, 20.0) == pytest.approx(5e-5, rel=0.03)
    tilted = Laboratory(tilt=3e-6).disturbance(1500.0, np.random.default_rng(3))
    assert np.std(tilted[:, :2], axis=0) == pytest.approx([GRAVITY * 3e-6] * 2, rel=0.4)
    assert not tilted[:, 2:].any()


def test_the_same_seed_gives_the_same_and_none_gives_nothing() -> None:
    first, again = (NOISY.disturbance(10.0, np.random.default_rng(4)) for _ in range(2))
    assert np.array_equal(first, again)
    assert not len(Laboratory(mains=0.1).disturbance(10.0, np.random.default_rng(4)))


def test_an_accelerated_floor_pulls_all_of_the_mass() -> None:
    still, moved = simulate(HARDWARE, STILL), pushed(BY_FLOOR, (0.0, 0.0, 0.02))
    carried = -still.wrench[0, 2] / GRAVITY
    assert late(moved.wrench - still.wrench)[2] == pytest.approx(-0.02 * carried, rel=1e-3)


def test_a_joint_s_torque_winds_its_gear_and_leaves_no_wrench() -> None:
    still, moved = simulate(HARDWARE, STILL), pushed(BY_JOINTS, (0.0, 0.5))
    wound = 0.5 * AT_REST / HARDWARE.drive("el", "Ka")
    assert late(moved.angles - still.angles)[1] == pytest.approx(wound, rel=0.05)
    # Only the lever of gravity moves, by the angle that is wound.
    assert np.abs(late(moved.wrench - still.wrench)[3:]).max() < 0.05 * 0.5 * AT_REST


def test_a_joint_is_noisier_while_it_moves() -> None:
    moving = commands(Axis(0.0).rest(1.0).accelerate(0.5, 0.2), Axis(70.0), 12.0)
    az = pushed(BY_JOINTS, (0.5, 0.0), moving).angles - simulate(HARDWARE, moving).angles
    assert late(az)[0] == pytest.approx(0.5 / HARDWARE.drive("az", "Ka"), rel=0.1)


def test_a_rotor_s_torque_turns_it_against_its_field() -> None:
    still, moved = simulate(HARDWARE, STILL), pushed(BY_ROTORS, (0.0, 2e-3))
    turned = late(moved.rotors - still.rotors)[1]
    assert 0 < turned < 2e-3 / (HARDWARE.drive("el", "Tmax") * HARDWARE.drive("el", "Kangle")) * 3


def test_mains_hum_at_their_frequency() -> None:
    t = np.arange(0.0, 100.0, 1e-3)
    hum = NOISY.hum(t, np.full(6, 2.0), np.random.default_rng(5))
    phase = np.exp(-2j * np.pi * MAINS_HZ * t)
    assert 2 * np.abs(phase @ hum) / len(t) == pytest.approx(np.full(6, 0.2), rel=0.02)
