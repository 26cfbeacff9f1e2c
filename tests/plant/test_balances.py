"""Energy, momentum, statics, mirror symmetry and eigenfrequencies of the plant against independent mechanics."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh

from kbs_process.plant.attach import attach
from kbs_process.plant.compiled.simulation import Simulation
from kbs_process.plant.laws import find, select
from kbs_process.plant.linear.modes import modes as modes_on_transducer
from kbs_process.plant.predict import predict
from kbs_process.plant.schedule import Schedule
from kbs_process.rig.model import Rig, substitute
from kbs_process.signals.records import Array
from plant import energetics as lab
from plant.plant_rigs import NOMINAL, body, joint, one_axis, rig, three_axis, two_axis

pytestmark = pytest.mark.slow

FREE = {"d0": 0.0, "d1": 0.0, "Ts0": 0.0, "b_m": 0.0, "fsv": 0.0}


def standing(position: Array) -> Schedule:
    rows = np.tile(np.asarray(position, dtype=float), (2, 1))
    return Schedule(np.array([0.0, 0.1]), rows, 0.0 * rows)


def ramp(start: Array, rate: Array, duration: float) -> Schedule:
    t = np.arange(0.0, duration + 0.1, 0.1)
    return Schedule(t, np.asarray(start) + np.outer(t, rate), np.tile(np.asarray(rate, dtype=float), (len(t), 1)))


def simulation(of: Rig, schedule: Schedule, step: float, end: float = 5.0) -> Simulation:
    return Simulation(of, select(NOMINAL), schedule, step=step, per_sample=1, angle_rate=1.0, end=end)


def with_drive(of: Rig, **values: float) -> Rig:
    return substitute(
        of, {f"joint.{j.name}.drive.parameters.{key}": value for j in of.joints for key, value in values.items()}
    )


def kicked(of: Rig, position: Array, step: float) -> Simulation:
    """A simulation at rest, then given rates of base, joints and rotors."""
    made = simulation(of, standing(position), step)
    rng = np.random.default_rng(5)
    n = len(of.joints)
    made.part("omega")[:] = 0.02 * rng.normal(size=3)
    made.part("qd")[:] = 0.05 * rng.normal(size=n)
    made.part("spin")[:] = 0.2 * rng.normal(size=n)
    return made


def energy_error(step: float) -> float:
    """Greatest error of total energy over 1 s of free vibration, as a share of the kinetic energy given."""
    of = with_drive(three_axis(damping=(0.0, 0.0, 0.0), amplifier=None), **FREE)
    made = kicked(of, np.array([0.3, 0.5, -0.4]), step)
    field = np.rint(made.fields[0]) / made.microsteps
    first = lab.energy(of, lab.motion(of, made), field)
    worst = 0.0
    for _ in range(40):
        made.advance(round(0.025 / step), 1)
        now = lab.energy(of, lab.motion(of, made), field)
        worst = max(worst, abs(sum(now) - sum(first)))
    return worst / first[0]


def test_energy_is_conserved_without_damping() -> None:
    coarse, fine = energy_error(2e-4), energy_error(1e-4)
    print(f"energy error over 1 s, share of the kinetic energy: {coarse:.1e} at 0.2 ms, {fine:.1e} at 0.1 ms")
    assert coarse < 2e-2
    assert fine < 0.35 * coarse  # second order


def test_energy_lost_is_energy_dissipated() -> None:
    step = 5e-5
    of = with_drive(three_axis(damping=(3.0, 2.0, 4.0), amplifier=None), **FREE | {"b_m": 1e-3, "fsv": 15.0})
    made = kicked(of, np.array([0.3, 0.5, -0.4]), step)
    field = np.rint(made.fields[0]) / made.microsteps
    energies, powers = [], []
    for _ in range(401):
        m = lab.motion(of, made)
        energies.append(sum(lab.energy(of, m, field)))
        powers.append(lab.dissipation(of, m))
        made.advance(5, 1)
    power = np.array(powers)
    dissipated = 5 * step / 3.0 * (power[0] + power[-1] + 4 * power[1::2].sum() + 2 * power[2:-1:2].sum())
    lost = energies[0] - energies[-1]
    print(f"lost {lost:.6e} J, dissipated {dissipated:.6e} J")
    assert lost > 1e-4
    assert lost == pytest.approx(dissipated, rel=2e-3)


@pytest.mark.parametrize("elastic", [True, False])
def test_wrench_is_weight_less_rate_of_momentum(elastic: bool) -> None:
    step = 1e-4
    settings: dict[str, Any] = {"amplifier": None, "tilt": (3e-3, -2e-3)}
    start, rate = np.array([0.3, 0.5, -0.4]), np.radians([2.0, -3.0, 4.0])
    of = three_axis(**settings)
    if not elastic:
        of = two_axis(stiffness=None, misalignment=(0.02, 0.01, -0.03), **settings)
        start, rate = start[:2], rate[:2]
    made = simulation(of, ramp(start, rate, 1.0), step)
    made.advance(3000, 1)
    states = []
    for _ in range(60):
        m = lab.motion(of, made)
        states.append((*lab.momentum(of, m), lab.plate(m.coordinates[:3])))
        states[-1] = (*states[-1], made.advance(1, 1)[0][0])
    mass = sum(float(b.mass) for b in of.bodies)
    errors, size = [], []
    for before, now, after in zip(states, states[1:], states[2:], strict=False):
        force = mass * lab.gravity(of) - (after[0] - before[0]) / (2 * step)
        moment = now[2] - (after[1] - before[1]) / (2 * step)
        expected = np.concatenate([now[3].T @ force, now[3].T @ moment])
        errors.append(now[4] - expected)
        size.append(expected)
    print("wrench against momentum, rms:", np.std(errors, axis=0), "of", np.std(size, axis=0))
    assert np.abs(errors).max() < 2e-4
    assert np.std(size, axis=0).min() > 1e-3  # there was something to measure


@pytest.mark.parametrize("stiffness", [None, (4000.0, 4000.0, 6000.0)])
def test_wrench_at_rest_is_the_weight_and_its_moment(stiffness: Any) -> None:
    of = two_axis(stiffness=stiffness, tilt=(2e-3, -1e-3))
    made = simulation(of, standing(np.radians([30.0, 70.0])), 2e-4)
    m = lab.motion(of, made)
    placed, R = lab.links(of, m.coordinates), lab.plate(m.coordinates[:3])
    force = sum(float(b.mass) for b in of.bodies) * lab.gravity(of)
    moment = sum(
        np.cross(placed[b.on][1] + placed[b.on][0] @ b.cog.value, float(b.mass) * lab.gravity(of)) for b in of.bodies
    )
    np.testing.assert_allclose(made.wrench[:3], R.T @ force, atol=1e-9)
    np.testing.assert_allclose(made.wrench[3:], R.T @ moment, atol=1e-9)
    if stiffness is not None:
        sag = np.array(stiffness) * m.coordinates[:3]
        np.testing.assert_allclose(sag, R @ made.wrench[3:], atol=3e-2)  # axes differ by the sag itself
        assert np.abs(sag).max() > 1.0
    else:
        level = simulation(two_axis(stiffness=None), standing(np.radians([30.0, 70.0])), 2e-4)
        np.testing.assert_allclose(level.wrench[:3], [0.0, 0.0, -28.0 * 9.80665], atol=1e-9)


def test_rest_stays_at_rest() -> None:
    of = two_axis()
    wrench = next(
        b.values for key, b in predict(of, NOMINAL, standing(np.radians([30.0, 70.0])),
        rate_Hz=100.0, angle_rate_Hz=10.0, duration_s=3.0) if key == "wrench"
    )  # fmt: skip
    assert np.abs(wrench - wrench[0]).max() < 1e-7


def test_mirror_image_gives_mirrored_wrench() -> None:
    """A reflection in the x-z plane turns azimuth, lateral force and the moments about x and z round."""
    twin = {True: (), False: ()}
    for mirrored in twin:
        s = -1.0 if mirrored else 1.0
        bodies = (
            body("base", "T", 8.0, (0.01, s * 0.02, 0.06), (0.05, 0.05, 0.04, s * 0.002, 0.001, s * 0.003)),
            body("azimuth", "az", 6.0, (0.01, s * -0.03, -0.02), (0.06, 0.05, 0.05)),
            body("antenna", "el", 14.0, (0.07, s * 0.06, -0.02), (0.7, 0.9, 0.8, s * 0.03, 0.02, s * -0.01)),
        )
        joints = (
            joint("az", "T", (0.0, 0.0, 1.0), (0.0, s * 0.01, 0.22), misalignment=(s * 0.01, 0.02, 0.0), d1=0.0),
            joint("el", "az", (0.0, -1.0, 0.0), (0.0, 0.0, 0.0), misalignment=(s * 0.02, 0.01, s * -0.03)),
        )
        schedule = ramp(np.array([s * 0.3, 1.1]), np.radians([s * 1.5, 0.7]), 3.0)
        blocks = predict(rig(bodies, joints), NOMINAL, schedule, rate_Hz=100.0, angle_rate_Hz=10.0, duration_s=3.0)
        twin[mirrored] = next(b.values for key, b in blocks if key == "wrench")
    reflected = twin[False] * np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    np.testing.assert_allclose(twin[True], reflected, atol=1e-6)
    assert np.std(reflected, axis=0).min() > 1e-3


def crossings(t: Array, signal: Array) -> float:
    """Frequency of a vibration from its first and last upward zero crossing, Hz."""
    x = signal - signal.mean()
    up = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
    exact = t[up] - x[up] * (t[up + 1] - t[up]) / (x[up + 1] - x[up])
    return float((len(exact) - 1) / (exact[-1] - exact[0]))


def test_free_rotor_vibrates_at_its_frequency() -> None:
    """sqrt((Tmax Kangle - 200 tcog + Ka / R^2) / Jr): the output, which hardly follows, adds 3e-4."""
    of = with_drive(one_axis(gravity=0.0, stiffness=None, amplifier=None), **FREE | {"tcog": 6e-3})
    made = simulation(of, standing(np.zeros(1)), 2e-5)
    made.part("spin")[:] = 0.1
    angle = []
    for _ in range(5000):
        made.advance(1, 1)
        angle.append(made.part("theta")[0])
    frequency = crossings(2e-5 * np.arange(5000), np.array(angle))
    expected = np.sqrt((0.35 * 100.0 - 200.0 * 6e-3 + 1e4 / 1e4) / 2e-5) / (2 * np.pi)
    print(f"rotor {frequency:.3f} Hz, expected {expected:.3f} Hz")
    assert frequency == pytest.approx(expected, rel=5e-4)


def test_stiff_gear_adds_the_rotor_times_ratio_squared() -> None:
    """A motor that lets go: the load falls with the inertia I + R^2 Jr."""
    of = with_drive(one_axis(stiffness=None, amplifier=None), **FREE | {"tcog": 0.0, "Ka": 1e6, "fsv": 200.0})
    made = simulation(of, standing(np.array([0.2])), 1e-4)
    q = made.part("q")[0]
    made.p[made.p == 0.35] = 0.0  # no field
    made.advance(2000, 1)
    load = of.bodies[1]
    r = np.array([load.cog.value[0], load.cog.value[2]])
    inertia = load.inertia.value[1] + float(load.mass) * (r @ r)
    # A turn by q raises the load; its potential energy becomes that of load and rotor.
    heights = [r[0] * np.sin(angle) + r[1] * np.cos(angle) for angle in (q, made.part("q")[0])]
    gained = float(load.mass) * 9.80665 * (heights[0] - heights[1])
    expected = -np.sqrt(2.0 * gained / (inertia + 100.0**2 * 2e-5))
    rate = made.part("qd")[0]
    print(f"rate after 0.2 s {rate:.5f} rad/s, expected {expected:.5f} rad/s")
    assert rate == pytest.approx(expected, rel=2e-3)
    assert made.part("theta")[0] / 100.0 - made.part("q")[0] == pytest.approx(0.0, abs=5e-6)


def test_base_resonance_is_the_eigenvalue() -> None:
    """Lowest mode of base, gears and rotors: ring-down against the eigenvalue of numerical Hessians."""
    of = with_drive(two_axis(gravity=0.0, damping=(0.0, 0.0, 0.0), amplifier=None), **FREE | {"tcog": 0.0})
    position = np.radians([20.0, 70.0])
    made = simulation(of, standing(position), 1e-4)
    rest = lab.motion(of, made)
    field = np.rint(made.fields[0]) / made.microsteps
    n = len(of.joints)

    def moved(d: Array, rates: Array) -> lab.Motion:
        coordinates = rest.coordinates + d[: 3 + n]
        carriers = np.array([lab.angular(of, j.parent, coordinates, rates[: 3 + n]) for j in of.joints])
        spin = rates[3 + n :] + np.einsum("ij,ij->i", lab.axes(of, coordinates), carriers)
        return lab.Motion(coordinates, rates[: 3 + n], rates[3 + n :], rest.theta + d[3 + n :], spin)

    size = 3 + 2 * n
    zero = np.zeros(size)
    M, K = np.empty((size, size)), np.empty((size, size))
    h = 1e-4
    for i, a in enumerate(np.eye(size)):
        for j, b in enumerate(np.eye(size)):
            M[i, j] = 0.25 * sum(s * lab.energy(of, moved(zero, a + s * b), field)[0] for s in (1, -1)) * 2
            K[i, j] = sum(
                s * t * lab.energy(of, moved(h * (s * a + t * b), zero), field)[1] for s in (1, -1) for t in (1, -1)
            ) / (4 * h * h)
    values, modes = eigh(K, M)
    expected = np.sqrt(values[0]) / (2 * np.pi)
    shape = 1e-4 * modes[:, 0] / np.abs(modes[:, 0]).max()
    made.part("alpha")[:] += shape[:3]
    made.part("q")[:] += shape[3 : 3 + n]
    made.part("theta")[:] += shape[3 + n :]
    tip = []
    for _ in range(2000):
        made.advance(10, 1)
        tip.append(made.part("alpha") @ shape[:3])
    frequency = crossings(1e-3 * np.arange(2000), np.array(tip))
    print(f"first resonance {frequency:.4f} Hz, eigenvalue {expected:.4f} Hz")
    assert 1.0 < expected < 20.0
    assert frequency == pytest.approx(expected, rel=1e-3)
    # The modes that reports name come from Jacobians of the bodies, not from these energies.
    named = modes_on_transducer(of, select(NOMINAL), position)
    assert named[0].frequency == pytest.approx(expected, rel=1e-4)
    assert [mode.axis for mode in named[:3]] == ["y", "x", "z"]


def test_a_gear_with_play_rests_on_one_side_of_it() -> None:
    """A loaded output sags by half the play more; one that nothing loads rests somewhere within it."""
    play, law = 4e-4, find("backlash")
    assert law is not None
    of, names = two_axis(), (*NOMINAL, "backlash")
    schedule = standing(np.array([0.0, 0.5]))

    def at_rest(width: float) -> Array:
        loose = attach(of, law, {"lost_motion": width, "soft_zone": max(width, 1e-6)})
        made = Simulation(loose, select(names), schedule, step=2e-3, per_sample=1, angle_rate=1.0, end=1.0)
        return made.part("q").copy()

    sag = np.abs(at_rest(play) - at_rest(0.0))
    assert sag[0] <= play
    assert sag[1] == pytest.approx(play, abs=1e-7)
