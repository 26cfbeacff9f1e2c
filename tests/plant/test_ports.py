"""What the laboratory does to the plant: power, reaction, statics, and the linearised plant's slopes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from kbs_process.errors import ConfigError
from kbs_process.plant.attach import attach
from kbs_process.plant.compiled.simulation import Simulation
from kbs_process.plant.effect import Effect, Normal, Parameter, Port
from kbs_process.plant.laws import select
from kbs_process.plant.laws.environment.bungee import BUNGEE
from kbs_process.plant.linear.linearise import linearise
from kbs_process.plant.schedule import Schedule
from kbs_process.rig.model import Rig, substitute
from kbs_process.signals.records import Array
from plant import energetics as lab
from plant.plant_rigs import NOMINAL, three_axis, two_axis

FREE = {"d0": 0.0, "d1": 0.0, "Ts0": 0.0, "b_m": 0.0, "fsv": 0.0}


def amplitude(name: str, unit: str) -> Parameter:
    return Parameter(name, unit, Normal(0.0, 1.0), "of the test", (-1e4, 1e4), role="amplitude")


def twisting(joint_angle: float, joint_rate: float, hold: float, stiff: float, damp: float) -> float:
    return hold - stiff * joint_angle - damp * joint_rate


def pushing(push: float) -> float:
    return push


def pulling(
    x: float, y: float, z: float, vx: float, vy: float, vz: float, pull: float, spring: float, drag: float
) -> tuple[float, float, float]:
    return pull - spring * x - drag * vx, -spring * y * y - drag * vy, 0.5 * pull - spring * z - drag * vz


def shaking(time: float, shake: float) -> tuple[float, float, float]:
    return shake * np.sin(30.0 * time), 0.5 * shake * np.cos(20.0 * time), -shake * np.sin(9.0 * time)


GROUND = Effect(
    "ground",
    Port.GROUND_TORQUE,
    twisting,
    (amplitude("hold", "N m"), amplitude("stiff", "N m/rad"), amplitude("damp", "N m s/rad")),
)
INSIDE = Effect("inside", Port.JOINT_TORQUE, pushing, (amplitude("push", "N m"),))
PULL = Effect(
    "pull",
    Port.EXTERNAL_FORCE,
    pulling,
    (amplitude("pull", "N"), amplitude("spring", "N/m"), amplitude("drag", "N s/m")),
)

pytestmark = pytest.mark.slow  # plants are compiled
SHAKE = Effect("shake", Port.BASE_ACCELERATION, shaking, (amplitude("shake", "m/s^2"),))
POINT = np.array([0.1, -0.05, 0.2])
LOADS = (INSIDE, GROUND, BUNGEE)
COG = np.array([0.07, 0.06, -0.02])


def moving(start: Array, rate: Array, duration: float = 2.0) -> Schedule:
    t = np.arange(0.0, duration + 0.1, 0.1)
    return Schedule(t, start + np.outer(t, rate), np.tile(rate, (len(t), 1)))


def standing(position: Any) -> Schedule:
    start = np.asarray(position, dtype=float)
    return moving(start, 0.0 * start)


def simulation(of: Rig, effects: tuple[Effect, ...], schedule: Schedule, step: float = 1e-4) -> Simulation:
    chosen = (*select(NOMINAL), *effects)
    return Simulation(of, chosen, schedule, step=step, per_sample=1, angle_rate=1.0, end=2.0)


def hung(of: Rig, cord: dict[str, float] | None = None, **ground: float) -> Rig:
    """The mechanism with a cord at the antenna's CoG and torques of the ground; absent unless given."""
    of = attach(attach(of, GROUND, ground, joints=["el"]), INSIDE)
    return attach(of, BUNGEE, cord, on="el", point=COG)


def pushed(of: Rig, push: float) -> Rig:
    return attach(of, INSIDE, {"push": push}, joints=["el"])


def at_rest(of: Rig, position: Any) -> Simulation:
    return simulation(of, LOADS, standing(position))


@pytest.mark.slow
def test_reaction_of_the_ground_is_felt_and_that_inside_a_joint_is_not() -> None:
    of, position = two_axis(stiffness=None, amplifier=None), np.radians([30.0, 70.0])
    bare, inside, ground = (at_rest(each, position) for each in (hung(of), pushed(hung(of), 2.0), hung(of, hold=2.0)))
    windup = np.array([made.part("q") - bare.part("q") for made in (inside, ground)])
    np.testing.assert_allclose(windup[0], windup[1], rtol=1e-9)  # the encoder cannot tell them apart
    assert windup[0, 1] == pytest.approx(2.0 / 1e4, rel=0.1)
    axis = lab.axes(of, np.concatenate([np.zeros(3), ground.part("q")]))[1]
    turned = bare.wrench + np.concatenate([np.zeros(3), 2.0 * axis])
    # The weight's moment follows the windup: 14 kg, 9 cm, 0.2 mrad.
    np.testing.assert_allclose(inside.wrench, bare.wrench, atol=14.0 * 9.81 * 0.1 * 2.2e-4)
    np.testing.assert_allclose(ground.wrench, turned, atol=14.0 * 9.81 * 0.1 * 2.2e-4)


def outside(of: Rig, m: lab.Motion) -> tuple[Array, Array, float]:
    """Force, moment about T's origin and power of the laboratory's loads, in undeflected T, by plain mechanics."""
    external = next(entry for entry in of.external if entry.name == "pull")
    number = {name: float(quantity) for name, quantity in external.parameters.items()}

    def point(coordinates: Array) -> Array:
        R, o = lab.links(of, coordinates)[external.on]
        place: Array = o + R @ POINT
        return place

    r = point(m.coordinates)
    v = (point(m.coordinates + lab.H * m.rates) - point(m.coordinates - lab.H * m.rates)) / (2 * lab.H)
    force = np.array(pulling(*r, *v, **number))
    moment, power = np.cross(r, force), float(force @ v)
    for i, (axis, joint) in enumerate(zip(lab.axes(of, m.coordinates), of.joints, strict=True)):
        value = {name: float(q) for name, q in joint.drive.parameters.items()}
        torque = twisting(m.coordinates[3 + i], m.rates[3 + i], value["hold"], value["stiff"], value["damp"])
        moment = moment + torque * axis
        power += torque * float(axis @ lab.angular(of, joint.name, m.coordinates, m.rates))
    return force, moment, power


def loaded(shake: float, **settings: Any) -> tuple[Rig, tuple[Effect, ...]]:
    of = three_axis(amplifier=None, **settings)
    of = attach(of, GROUND, {"hold": 0.8, "stiff": 3.0, "damp": 0.7})
    of = attach(of, PULL, {"pull": 5.0, "spring": 40.0, "drag": 6.0}, on="two", point=POINT)
    return attach(of, SHAKE, {"shake": shake}), (GROUND, PULL, SHAKE)


@pytest.mark.slow
def test_energy_gained_is_the_loads_work_less_what_is_dissipated() -> None:
    step = 5e-5
    of, effects = loaded(0.0, damping=(3.0, 2.0, 4.0))
    free = {f"joint.{j.name}.drive.parameters.{k}": v for j in of.joints for k, v in FREE.items()}
    of = substitute(of, free)
    made = simulation(of, effects, standing([0.3, 0.5, -0.4]), step)
    rng = np.random.default_rng(5)
    made.part("omega")[:] = 0.02 * rng.normal(size=3)
    made.part("qd")[:] = 0.3 * rng.normal(size=3)
    made.part("spin")[:] = 30.0 * made.part("qd")
    field = np.rint(made.fields[0]) / made.microsteps
    energies, powers, works = [], [], []
    for _ in range(401):
        m = lab.motion(of, made)
        energies.append(sum(lab.energy(of, m, field)))
        works.append(outside(of, m)[2])
        powers.append(works[-1] - lab.dissipation(of, m))
        made.advance(5, 1)

    def simpson(power: Any) -> float:
        y = np.array(power)
        return float(5 * step / 3.0 * (y[0] + y[-1] + 4 * y[1::2].sum() + 2 * y[2:-1:2].sum()))

    gained, work, both = energies[-1] - energies[0], simpson(works), simpson(powers)
    print(f"gained {gained:.6e} J; work of the loads {work:.6e} J, less what is dissipated {both:.6e} J")
    assert abs(work) > 1e-3
    assert gained == pytest.approx(both, abs=2e-3 * abs(work))


def test_wrench_is_weight_and_loads_less_rate_of_momentum() -> None:
    step = 1e-4
    of, effects = loaded(0.4, tilt=(3e-3, -2e-3))
    schedule = moving(np.array([0.3, 0.5, -0.4]), np.radians([2.0, -3.0, 4.0]))
    made = simulation(of, effects, schedule, step)
    made.advance(3000, 1)
    states = []
    for _ in range(60):
        m = lab.motion(of, made)
        instant = made.first * step
        P, L, _ = lab.momentum(of, m)
        R, (force, moment, _) = lab.plate(m.coordinates[:3]), outside(of, m)
        # In axes that shake with the floor, masses have their weight less what the floor accelerates.
        falling = lab.gravity(of) - np.array(shaking(instant, 0.4))
        mass = sum(float(b.mass) for b in of.bodies)
        placed = lab.links(of, m.coordinates)
        weights = sum(
            float(b.mass) * np.cross(placed[b.on][1] + placed[b.on][0] @ b.cog.value, falling) for b in of.bodies
        )
        states.append((P, L, mass * falling + force, weights + moment, R, made.advance(1, 1)[0][0]))
    errors, size = [], []
    for before, now, after in zip(states, states[1:], states[2:], strict=False):
        force = now[2] - (after[0] - before[0]) / (2 * step)
        moment = now[3] - (after[1] - before[1]) / (2 * step)
        expected = np.concatenate([now[4].T @ force, now[4].T @ moment])
        errors.append(now[5] - expected)
        size.append(expected)
    print("wrench against momentum, greatest:", np.abs(errors).max(axis=0), "of", np.std(size, axis=0))
    assert np.abs(errors).max() < 4e-4
    assert np.std(size, axis=0).min() > 1e-2


def test_cord_carries_what_its_stretch_says() -> None:
    """Level antenna, 60 N/m, 3.0 m long where 0.7117 m are free: 137.3 N straight up at the CoG."""
    of = two_axis(stiffness=None, amplifier=None)
    cord = {"stiffness": 60.0, "free_length": 3.0 - 137.3 / 60.0}
    cord |= {"anchor_x": 0.07, "anchor_y": 0.06, "anchor_z": 3.2}
    free, made, slack = (at_rest(hung(of, each), [0.0, 0.0]) for each in (None, cord, cord | {"free_length": 4.0}))
    change = made.wrench - free.wrench
    np.testing.assert_allclose(change[:3], [0.0, 0.0, 137.3], atol=0.15)  # the gear unwinds by 0.9 mrad
    np.testing.assert_allclose(change[3:], [0.06 * 137.3, -0.07 * 137.3, 0.0], atol=0.02)
    unwound = made.part("q")[1] - free.part("q")[1]
    assert unwound == pytest.approx(137.3 * 0.07 / 1e4, rel=0.05)
    np.testing.assert_array_equal(slack.wrench, free.wrench)


def test_slopes_of_loads_are_those_of_the_plant() -> None:
    """Static response of the linearised plant to a push inside a joint, against the change of the equilibrium."""
    of = two_axis(amplifier=None, tilt=(0.02, -0.03))
    of = substitute(of, {f"joint.{name}.drive.parameters.tcog": 0.0 for name in of.joint_names})
    cord = {"stiffness": 3e3, "free_length": 1.2, "anchor_x": 0.3, "anchor_y": -0.1, "anchor_z": 1.5}
    of, position = hung(of, cord, stiff=15.0), np.radians([20.0, 30.0])
    here, there = (at_rest(pushed(of, push), position) for push in (-0.5, 0.5))
    moved = np.concatenate(
        [
            there.part("alpha") - here.part("alpha"),
            there.part("q") - here.part("q"),
            (there.part("theta") - here.part("theta")) / 100.0,
        ]
    )
    middle = 0.5 * (there.part("q") + here.part("q"))
    push = np.eye(7)[4]
    system, bare = (linearise(of, (*select(NOMINAL), *loads), middle) for loads in (LOADS, ()))
    expected, without = (np.linalg.solve(each.K, push) for each in (system, bare))
    change, linear = there.wrench - here.wrench, system.gravity @ expected
    print("moved", moved, "\nlinear", expected, "\nwithout loads", without)
    print("wrench", change, "\nlinear", linear)
    np.testing.assert_allclose(moved, expected, rtol=0.02, atol=0.02 * np.abs(expected[:3]).max())
    np.testing.assert_allclose(change, linear, rtol=0.02, atol=0.01 * np.abs(linear).max())
    assert np.abs(without[:3] - expected[:3]).max() > 0.5 * np.abs(expected[:3]).max()


def test_what_a_load_lacks_is_said() -> None:
    of = two_axis(stiffness=None, amplifier=None)
    with pytest.raises(ConfigError, match="nothing says where it acts"):
        simulation(of, (BUNGEE,), standing([0.0, 0.0]))
    with pytest.raises(ConfigError, match="no link that hangs"):
        simulation(attach(of, BUNGEE), (BUNGEE,), standing([0.0, 0.0]))
