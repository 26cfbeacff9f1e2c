"""A mounting whose moment is not linear: power, statics, slopes, signs, steps, and what a rig has to have for it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from kbs_process.errors import ConfigError
from kbs_process.plant.attach import attach
from kbs_process.plant.compiled.simulation import Simulation
from kbs_process.plant.effect import Effect, Normal, Parameter, Port, State
from kbs_process.plant.laws import select
from kbs_process.plant.laws.environment.base_hardening import BASE_HARDENING, moment
from kbs_process.plant.laws.hysteresis.bouc_wen import BASE_HYSTERESIS
from kbs_process.plant.linear.linearise import linearise
from kbs_process.plant.linear.mounted import mounted_sag
from kbs_process.plant.predict import DEFAULT_STEP, SLIPPING_STEP
from kbs_process.plant.schedule import Schedule
from kbs_process.rig.model import Rig, substitute
from kbs_process.signals.records import Array
from plant import energetics as lab
from plant.plant_rigs import CODE, NOMINAL, streams, two_axis

pytestmark = pytest.mark.slow

FREE = {"d0": 0.0, "d1": 0.0, "Ts0": 0.0, "b_m": 0.0, "fsv": 0.0, "tcog": 0.0}
HARD = {"base_hardening_x": 1.0, "base_hardening_y": 0.7, "base_hardening_z": 2.0, "base_hardening_power": 3.0}
LOOP = {"base_loop_x": 0.3, "base_loop_y": 0.2, "base_loop_z": 0.3, "base_slip_angle": 2e-5}
NOISE = np.array([0.02] * 3 + [0.002] * 3)


def standing(position: Any, duration: float = 2.0) -> Schedule:
    t = np.arange(0.0, duration + 0.1, 0.1)
    return Schedule(t, np.tile(np.asarray(position, dtype=float), (len(t), 1)), np.zeros((len(t), 2)))


def moving(duration: float) -> Schedule:
    t = np.arange(0.0, duration + 0.2, 0.1)
    rate = np.outer(np.minimum(t, 1.0), np.radians([1.0, 0.7]))
    return Schedule(t, np.array([0.3, 1.2]) + 0.1 * np.cumsum(rate, axis=0), rate)


def simulation(of: Rig, effects: tuple[Effect, ...], schedule: Schedule, step: float = 1e-4) -> Simulation:
    chosen = (*select(NOMINAL), *effects)
    return Simulation(of, chosen, schedule, step=step, per_sample=1, angle_rate=1.0, end=2.0, taps=True)


def lossless(damping: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Rig:
    of = two_axis(amplifier=None, damping=damping)
    return substitute(of, {f"joint.{j.name}.drive.parameters.{k}": v for j in of.joints for k, v in FREE.items()})


def shaken(of: Rig, effect: Effect, step: float, steps: int) -> tuple[Array, Array, Array]:
    """Energy without the mounting's (n,), base angles (n, 3) and the effect's states, of a plate that was knocked.

    Every fourth step is looked at, far more than a hundred times in a period of the plate.
    """
    made = simulation(of, (effect,), standing([0.3, 1.2]), step)
    made.part("omega")[:] = [4e-3, -3e-3, 2e-3]
    field = np.rint(made.fields[0]) / made.microsteps
    energies, angles, states = [], [], []
    for _ in range(steps // 4):
        m = lab.motion(of, made)
        energies.append(sum(lab.energy(of, m, field)))
        angles.append(m.coordinates[:3])
        states.append(made.part("y").copy())
        made.advance(4, 1)
    return np.array(energies), np.array(angles), np.array(states)


def test_what_a_stiffening_mounting_takes_it_gives_back() -> None:
    of = attach(lossless(), BASE_HARDENING, HARD)
    energy, alpha, _ = shaken(of, BASE_HARDENING, 2e-4, 2000)
    weights = np.array([HARD[f"base_hardening_{axis}"] for axis in "xyz"])
    stored = 1e-3 / 4.0 * (np.abs(alpha / 1e-3) ** 4) @ weights
    spread = np.ptp(energy + stored) / np.ptp(stored)
    print(f"energy kept to {spread:.1e} of what the mounting stores")
    assert spread < 2e-3
    assert np.ptp(stored) > 1e-6


def test_micro_slip_takes_energy_and_never_gives_more_than_it_stored() -> None:
    of = attach(lossless(), BASE_HYSTERESIS, LOOP)
    energy, alpha, states = shaken(of, BASE_HYSTERESIS, 2e-4, 3000)
    assert np.abs(states).max() < 1.001
    turned = np.abs(np.diff(alpha, axis=0)).sum(axis=0).max()
    assert turned > 20 * LOOP["base_slip_angle"]
    # What is elastic in it holds no more than half the loop over the angle of slip, about each axis.
    loops = [LOOP[f"base_loop_{axis}"] for axis in "xyz"]
    held = 0.5 * LOOP["base_slip_angle"] * sum(loops)
    assert np.maximum.accumulate(energy[::-1])[::-1].max() - energy[0] < 1e-3 * held
    gained = (energy - np.minimum.accumulate(energy)).max()
    lost = energy[0] - energy[-1]
    print(f"lost {lost:.2e} J, gained back at most {gained:.2e} of {held:.2e} J that are stored")
    assert lost > 3 * held
    assert gained < held


def test_plate_rests_where_springs_and_mounting_carry_the_weight() -> None:
    """And the wrench is that of the weight on a plate of that sag: nothing of the mounting's moment is added to it."""
    of = attach(two_axis(amplifier=None), BASE_HARDENING, HARD)
    made, bare = (simulation(of, effects, standing([0.3, 0.2])) for effects in ((BASE_HARDENING,), ()))
    alpha = made.part("alpha")
    held = np.array(of.transducer.stiffness.value) * alpha  # type: ignore[union-attr]
    held -= moment(*alpha, *HARD.values())
    np.testing.assert_allclose(made.wrench[3:], held, atol=2e-2)  # sag turns axes by 1 mrad: of 275 N, 9 N m
    np.testing.assert_allclose(made.wrench[3:], bare.wrench[3:], atol=0.1)
    assert np.abs(alpha - bare.part("alpha")).max() > 1e-4
    expected = mounted_sag(of, (BASE_HARDENING,), made.part("q"))
    np.testing.assert_allclose(alpha, expected, atol=3e-3 * np.abs(alpha).max())


def test_slopes_of_the_mounting_are_those_of_the_plant() -> None:
    """Static answer of the plate to more weight's moment, by the linear plant and by two equilibria."""
    of = attach(two_axis(amplifier=None), BASE_HARDENING, HARD)
    of = substitute(of, {f"joint.{name}.drive.parameters.tcog": 0.0 for name in of.joint_names})
    effects = (*select(NOMINAL), BASE_HARDENING)
    pushes = (-0.02, 0.02)
    held = Effect(
        "held",
        Port.BASE_TORQUE,
        holding,
        (Parameter("hold", "N m", Normal(0.0, 1.0), "of the test", (-1.0, 1.0), role="amplitude"),),
    )
    here, there = (
        simulation(attach(of, held, {"hold": push}), (BASE_HARDENING, held), standing([0.3, 0.2])).part("alpha")
        for push in pushes
    )
    system = linearise(of, effects, np.array([0.3, 0.2]))
    bare = linearise(of, select(NOMINAL), np.array([0.3, 0.2]))
    push = (pushes[1] - pushes[0]) * np.eye(len(system.K))[1]
    expected, without = (np.linalg.solve(each.K, push)[:3] for each in (system, bare))
    np.testing.assert_allclose(there - here, expected, rtol=0.02, atol=0.02 * np.abs(expected).max())
    assert np.abs(without - expected).max() > 0.1 * np.abs(expected).max()


def holding(base_x: float, hold: float) -> tuple[float, float, float]:
    return 0.0 * base_x, hold, 0.0


@pytest.mark.parametrize(
    ("effect", "given", "begun"), [(BASE_HARDENING, HARD, DEFAULT_STEP), (BASE_HYSTERESIS, LOOP, SLIPPING_STEP)]
)
def test_halving_the_step_moves_less_than_a_tenth_of_the_noise(
    effect: Effect, given: dict[str, float], begun: float
) -> None:
    of = attach(two_axis(), effect, given)

    def run(step: float | None) -> dict[str, Array]:
        return streams(
            of, [*NOMINAL, effect.name], moving(6.0), rate_Hz=100.0, angle_rate_Hz=20.0, duration_s=6.0,
            step_s=step, quantise=False,
        )  # fmt: skip

    coarse, fine = run(None), run(0.5 * begun)
    moved = np.sqrt(np.mean((coarse["wrench"] - fine["wrench"]) ** 2, axis=0)) / NOISE
    print("moved, in noise:", moved)
    assert 0.0 < moved.max() < 0.1
    assert np.abs(coarse["angle"] - fine["angle"]).max() < 0.01 * CODE


def test_a_slip_angle_passed_within_a_step_bounds_no_stability() -> None:
    """A loop so stiff before it slips that the plate on it turns by 1.5 rad in a step, and one that slips in each."""
    of = attach(two_axis(), BASE_HYSTERESIS, LOOP | {"base_loop_y": 1.0, "base_slip_angle": 1e-6})
    made = simulation(of, (BASE_HYSTERESIS,), moving(2.0), 2e-3)
    _, _, taps = made.advance(900, 1)
    assert np.abs(made.part("y")).max() < 1.5
    bare = simulation(two_axis(), (), moving(2.0), 2e-3).advance(900, 1)[2]
    assert np.ptp(taps[:, -6:-3], axis=0).max() < 2.0 * np.ptp(bare[:, -6:-3], axis=0).max()


def creeping(base_rate_x: float, strain: float, creep: float, creep_time: float) -> tuple[float, float, float, float]:
    return -creep * strain, 0.0, 0.0, base_rate_x - strain / creep_time


def test_a_state_settles_within_a_step_or_never() -> None:
    """A Maxwell element that creeps much faster than a step is not there, one that creeps much slower is a spring."""
    creep = Effect(
        "creep",
        Port.BASE_TORQUE,
        creeping,
        (
            Parameter("creep", "N m/rad", Normal(0.0, 1e3), "spring", (0.0, 1e6), role="amplitude"),
            Parameter("creep_time", "s", Normal(1.0, 1.0), "in which it yields", (1e-9, 1e9)),
        ),
        states=(State("strain", "rad", 0.0, "of the spring"),),
    )

    def angles(of: Rig, *effects: Effect) -> Array:
        made = simulation(of, effects, moving(2.0), 2e-3)
        angle = made.advance(900, 1)[2][:, -6:-3]
        return np.asarray(angle - angle[0])

    bare = angles(two_axis())
    fast, slow = (angles(attach(two_axis(), creep, {"creep": 2e3, "creep_time": t}), creep) for t in (1e-7, 1e7))
    stiffer = angles(substitute(two_axis(), {"transducer.stiffness": [6e3, 4e3, 6e3]}))
    size = np.abs(bare[:, 0]).max()
    assert np.abs(fast - bare).max() < 0.01 * size
    assert np.abs(slow - stiffer)[:, 0].max() < 0.05 * size
    assert np.abs(slow - bare)[:, 0].max() > 0.2 * size


def test_either_sense_is_like_the_other() -> None:
    signals = {"base_x": 1.3e-3, "base_y": -4e-4, "base_z": 2e-4}
    signals |= {"base_rate_x": 1e-4, "base_rate_y": -3e-5, "base_rate_z": 2e-5, "time": 0.0}
    for effect, given in ((BASE_HARDENING, HARD), (BASE_HYSTERESIS, LOOP | {"base_slip_power": 1.5})):
        states = {state.name: 0.2 * (k + 1) for k, state in enumerate(effect.states)}
        known = signals | given | states
        opposite = known | {name: -number for name, number in (signals | states).items()}
        here, there = (
            np.array(effect.equation(*(each[name] for name in effect.arguments))) for each in (known, opposite)
        )
        np.testing.assert_array_equal(here, -there)
        assert np.all(here != 0.0)


def test_a_rigid_transducer_has_no_such_mounting() -> None:
    of = attach(two_axis(stiffness=None), BASE_HARDENING, HARD)
    with pytest.raises(ConfigError, match="transducer is rigid"):
        simulation(of, (BASE_HARDENING,), standing([0.3, 0.2]))


def towing(vx: float, slack: float) -> tuple[float, float, float, float]:
    return slack, 0.0, 0.0, vx


def test_a_state_that_a_port_cannot_integrate_is_an_error_at_import() -> None:
    with pytest.raises(TypeError, match="no states of its own"):
        Effect("trial", Port.EXTERNAL_FORCE, towing, (), states=(State("slack", "m", 0.0, ""),))


def test_the_mounting_stays_in_the_laboratory() -> None:
    assert not BASE_HARDENING.flies and not BASE_HYSTERESIS.flies
