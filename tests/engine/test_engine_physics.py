"""The engine by itself: statics, momentum, energy, resonance, stiction, the loop."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from engine import Bungee, Commands, Hardware, simulate
from engine.drive import drive_numbers, motor_torque
from engine.rigid import AZ, EL, PLATE, ROTOR_AZ, ROTOR_EL, build, rotation
from engine.simulation import equilibrium, integrate
from engine.trajectories import Axis, commands

pytestmark = pytest.mark.slow

CAMPAIGN = Path(__file__).parents[2] / "campaigns" / "EL089"
NOMINAL = Hardware.from_campaign(CAMPAIGN)
G = 9.80665

FRICTIONLESS = {f"joint.{axis}.drive.{name}": 0.0 for axis in ("az", "el") for name in ("d0", "d1", "Ts0")}
UNDAMPED = FRICTIONLESS | {
    "transducer.damping": 0.0,
    **{f"joint.{axis}.drive.{name}": 0.0 for axis in ("az", "el") for name in ("b_m", "fsv")},
}


def step_of(az: float, el: float, *, base: tuple[float, float] = (10.0, 75.0), seconds: float = 4.0) -> Commands:
    """Rest at `base` (deg), then a jump by (az, el) deg within the first cycle."""
    t = 0.1 * np.arange(round(seconds / 0.1) + 1)
    position = np.tile(np.radians(base), (len(t), 1))
    position[1:] += np.radians([az, el])
    return Commands(t, position, np.zeros_like(position))


def centres(hardware: Hardware, az: float, el: float) -> list[tuple[float, np.ndarray]]:
    """Mass and CoG (in T's axes) of every body, with no misalignment."""
    height = hardware["joint.az.origin"]
    R_az = rotation(np.array([0.0, 0.0, az]))
    R_el = R_az @ rotation(np.array([0.0, -el, 0.0]))
    place = {
        "base": hardware["body.base.cog"],
        "azimuth": height + R_az @ hardware["body.azimuth.cog"],
        "antenna": height + R_el @ hardware["body.antenna.cog"],
    }
    return [(hardware.scalar(f"body.{name}.mass"), where) for name, where in place.items()]


@pytest.mark.parametrize("tilt", [(0.0, 0.0), (3e-3, -2e-3)])
def test_at_rest_the_wrench_is_the_weight_and_r_cross_weight(tilt: tuple[float, float]) -> None:
    hardware = NOMINAL.with_values({"transducer.tilt": tilt})
    result = simulate(hardware, step_of(0.0, 0.0, base=(40.0, 72.0), seconds=0.2))
    sag_x, sag_y, sag_z = result.plate[0]
    R = rotation(np.array([sag_x, 0, 0])) @ rotation(np.array([0, sag_y, 0])) @ rotation(np.array([0, 0, sag_z]))
    tx, ty = tilt
    gravity = R.T @ (G * np.array([np.sin(ty), -np.sin(tx) * np.cos(ty), -np.cos(tx) * np.cos(ty)]))
    bodies = centres(hardware, *result.angles[0])
    force = sum(m * gravity for m, _ in bodies)
    torque = sum(np.cross(r, m * gravity) for m, r in bodies)
    np.testing.assert_allclose(result.wrench[0], [*force, *torque], atol=1e-7)
    # The springs carry it; their axes differ from the plate's by the sag.
    np.testing.assert_allclose(hardware["transducer.stiffness"] * result.plate[0], result.wrench[0, 3:], atol=0.03)


def test_force_moves_the_centre_of_mass() -> None:
    """Without gravity, the force's double integral over a move is mass times the CoG's displacement."""
    hardware = NOMINAL.with_values({"gravity.magnitude": 0.0})
    path = commands(Axis(-10.0).move(12.0, 1.0, 0.5), Axis(70.0).move(9.0, 1.5, 0.6), 16.0)
    dense = integrate(hardware, path)
    dt = dense.t[1] - dense.t[0]
    moved = dt * np.cumsum(dt * np.cumsum(-dense.wrench[:, :3], axis=0), axis=0)[-1]
    begin, end = (sum(m * r for m, r in centres(hardware, q[AZ], q[EL])) for q in (dense.q[0], dense.q[-1]))
    displacement = end - begin
    assert np.linalg.norm(displacement) > 0.1
    np.testing.assert_allclose(moved, displacement, atol=2e-4)


def test_undamped_vibration_neither_decays_nor_grows() -> None:
    hardware = NOMINAL.with_values(UNDAMPED)
    dense = integrate(hardware, step_of(0.02, 0.02, seconds=12.0))
    torque = dense.wrench[:, 3:] - dense.wrench[:, 3:].mean(axis=0)
    early, late = (np.sqrt(np.mean(torque[part] ** 2)) for part in (slice(10000, 60000), slice(70000, 120000)))
    assert early > 0.1
    assert late == pytest.approx(early, rel=0.02)


def test_resonance_is_the_eigenfrequency() -> None:
    """The ring-down after a step peaks where mass matrix and stiffnesses say."""
    hardware = NOMINAL.with_values(FRICTIONLESS | {"gravity.magnitude": 0.0})
    rigid = build(hardware, 1e-4)
    rest = equilibrium(hardware, rigid, np.radians([10.0, 75.0]))
    M = np.zeros((7, 7))
    mujoco.mj_fullM(rigid.model, rigid.data, M)
    K = np.zeros((7, 7))
    K[PLATE, PLATE] = np.diag(hardware["transducer.stiffness"])
    for rotor, joint, axis in ((ROTOR_AZ, AZ, "az"), (ROTOR_EL, EL, "el")):
        p = drive_numbers(hardware, axis)
        lever = np.zeros(7)
        lever[rotor], lever[joint] = 1 / p.R, -1
        K += p.Ka * np.outer(lever, lever)
        K[rotor, rotor] += p.Tmax * p.Kangle - 200 * p.tcog * np.cos(200 * rest[rotor] + p.phi_cog)
    modes = np.sort(np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).real)) / (2 * np.pi)
    result = simulate(hardware, step_of(0.0, 0.02, seconds=30.0))
    torque = result.wrench[200:, 4] - result.wrench[200:, 4].mean()
    spectrum = np.abs(np.fft.rfft(torque * np.hanning(len(torque)), 16 * len(torque)))
    peak = np.fft.rfftfreq(16 * len(torque), 0.01)[np.argmax(spectrum)]
    assert np.min(np.abs(modes - peak)) < 0.02
    assert 2.0 < peak < 10.0


def test_stiction_holds_up_to_its_level_and_not_beyond() -> None:
    microstep = 2 * np.pi / 12800  # motor rad; turns the torque by Tmax pi/64 = 0.017 N m
    still = {"transducer.stiffness": 1e6, "gravity.magnitude": 0.0, "joint.az.drive.tcog": 0.0}
    values = still | {"joint.az.drive.Ts0": 0.03, "joint.az.drive.phi_stat": 0.0}
    hardware = NOMINAL.with_values(values)
    for microsteps, sticks in ((1, True), (3, False)):
        jump = np.degrees(microsteps * microstep) / 100
        rotors = simulate(hardware, step_of(jump, 0.0, base=(0.0, 75.0), seconds=1.0)).rotors[:, 0]
        assert (np.ptp(rotors) < 1e-9) == sticks
    after = 0.35 * np.sin(100 * (3 * microstep - rotors[-1]))
    assert 0 < after <= 0.03  # slipped, then held by what is left


def test_motor_torque_is_the_mean_over_the_step() -> None:
    p = drive_numbers(NOMINAL, "el")
    start, end, th_r = 0.1003, 0.1021, 0.0995
    field = np.linspace(start, end, 200001)
    NN = np.round(field * 12800 / (2 * np.pi))
    mean = np.mean(0.35 * np.sin(np.pi / 64 * NN - 100 * th_r))
    assert motor_torque(p, th_r, start, end) == pytest.approx(mean, abs=2e-6)
    assert motor_torque(p, th_r, end, start) == pytest.approx(mean, abs=2e-6)


def test_closed_loop_takes_the_sag_away() -> None:
    path = step_of(0.0, 0.0, base=(0.0, 70.0), seconds=20.0)
    for loop in ("open", "closed"):
        result = simulate(NOMINAL.with_values({"loop": loop}), path)
        error = np.abs(path.position[0, 1] - result.angles[-1, 1])
        if loop == "open":
            assert error > 5e-4  # gravity against Ka
        else:
            assert error < 2 * 3.834951969714103e-4


def test_bungee_carries_its_tension() -> None:
    cord = Bungee(anchor=(0.07, 0.06, 3.2), stiffness=60.0, free_length=1.0)
    path = step_of(0.0, 0.0, base=(0.0, 0.0), seconds=0.2)
    free, hung = (simulate(NOMINAL.with_values({"bungee": b}), path).wrench[0] for b in (None, cord))
    assert hung[2] - free[2] == pytest.approx(60.0 * (3.0 - 1.0), rel=2e-3)
    np.testing.assert_allclose(hung[3:5] - free[3:5], [0.06 * 120.0, -0.07 * 120.0], rtol=2e-2)
