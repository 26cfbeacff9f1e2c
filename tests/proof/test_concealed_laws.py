"""Physics that the generator conceals: absent at amplitude zero, present otherwise, and at its port."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from engine import Commands, Hardware, Result, simulate
from engine.ports import BODY, OUT, Extra
from engine.simulation import integrate
from engine.trajectories import Axis, commands
from proof.concealed import effects
from proof.concealed.effects import BY_NAME, PHYSICS
from proof.concealed.laws import COLUMNS, STATES, Law, act
from proof.concealed.observed import Motion
from proof.concealed.physics import Effect, Within

pytestmark = pytest.mark.slow

CAMPAIGN = Path(__file__).parents[2] / "campaigns" / "EL089"
HARDWARE = Hardware.from_campaign(CAMPAIGN, seed=5)
PATH = commands(Axis(10.0).accelerate(0.4, 0.4).accelerate(-0.4, 0.4), Axis(60.0).accelerate(0.5, 0.25), 4.0)
SWEPT = {"az": (np.radians(9.8), np.radians(10.4)), "el": (np.radians(60.0), np.radians(61.5))}
SPANS = np.array([[-1.0, 1.0]] * 6)
STILL = Commands(0.1 * np.arange(11), np.tile(np.radians([20.0, 65.0]), (11, 1)), np.zeros((11, 2)))


@cache
def motion() -> Motion:
    return Motion.of(HARDWARE, PATH)


def drawn(name: str, **shapes: float) -> Effect:
    physics = BY_NAME[name]
    if shapes:
        physics = replace(
            physics, shapes=tuple(replace(s, drawn=float(shapes.get(s.name, 0.0))) for s in physics.shapes)
        )
    return effects.draw(physics, np.random.default_rng(3), "development", SWEPT)


def extra(effect: Effect, amplitude: float) -> Extra:
    return effects.extra((effect.scaled(amplitude),), HARDWARE, SPANS, 4.0)


@pytest.mark.parametrize("name", BY_NAME)
def test_absent_at_amplitude_zero_and_present_at_the_first_one_tried(name: str) -> None:
    effect = drawn(name)
    without = motion().observed()
    np.testing.assert_allclose(
        motion().observed(extra=extra(effect, 0.0)), without, atol=2e-9, err_msg="at amplitude zero"
    )
    change = np.abs(motion().observed(extra=extra(effect, BY_NAME[name].first)) - without).max(axis=0)
    assert np.any(change[:6] > 1e-6) or np.any(change[6:] > 1e-9), change
    assert np.all(change[:6] < 20.0) and np.all(change[6:] < 0.05), change


def test_every_port_is_covered_and_several_are_in_no_catalogue() -> None:
    ports = {physics.port for physics in PHYSICS}
    assert ports == {
        "motor torque", "transmission", "joint torque", "external wrench", "mass properties", "base", "appendage",
        "controller", "transducer", "encoder", "clock",
    }  # fmt: skip
    unnamed = [physics for physics in PHYSICS if physics.family == "unnamed"]
    assert len(unnamed) >= 6 and not any(physics.catalogued for physics in unnamed)


def at_rest(effect: Effect, amplitude: float) -> tuple[Result, Result]:
    acting = simulate(HARDWARE, STILL, extra=extra(effect, amplitude))
    return acting, simulate(HARDWARE, STILL)


def test_a_harness_inside_a_joint_leaves_windup_and_no_wrench() -> None:
    with_, without = at_rest(drawn("exponential harness", rest=0.9, scale=0.3), 0.5)
    if drawn("exponential harness", rest=0.9, scale=0.3).place == "az":
        pytest.fail("this draw is meant for elevation or azimuth at 0.9 rad from rest")
    torque = -0.5 * np.sinh((np.radians(65.0) - 0.9) / 0.3)
    windup = with_.angles[0, 1] - without.angles[0, 1]
    stiffness = 1 / (1 / 1e4 + 1 / (100**2 * 35.0))  # gear and magnetic spring, nominally
    assert windup == pytest.approx(torque / stiffness, rel=0.3)
    # The antenna's CoG moves with the windup; nothing else reaches the transducer.
    assert np.abs(with_.wrench[0] - without.wrench[0]).max() < 2e-2 * abs(torque)


def test_a_cable_to_the_ground_is_felt_by_the_transducer() -> None:
    effect = drawn("saturating cable to the ground", rest=0.1, scale=0.2)
    with_, without = at_rest(effect, 0.3)
    torque = -0.3 * (np.tanh((np.radians(20.0) - 0.1) / 0.2) + np.tanh(0.1 / 0.2))
    assert with_.wrench[0, 5] - without.wrench[0, 5] == pytest.approx(torque, rel=1e-2)


def test_an_appendage_hangs_still_and_rings_at_its_frequency() -> None:
    effect = drawn("mass on a spring", frequency=3.0, damping=0.005, z=1.0, **{"point x": 0.5})
    with_, without = at_rest(effect, 0.2)
    assert np.abs(with_.wrench[-1] - without.wrench[-1]).max() < 1e-3
    jump = replace(
        STILL, t=0.1 * np.arange(101), position=np.tile(STILL.position[0], (101, 1)), rate=np.zeros((101, 2))
    )
    jump.position[1:, 1] += np.radians(0.02)
    ringing = [simulate(HARDWARE, jump, extra=e).wrench[150:, 4] for e in (extra(effect, 0.2), Extra())]
    change = (ringing[0] - ringing[1]) * np.hanning(len(ringing[0]))
    spectrum = np.abs(np.fft.rfft(change, 16 * len(change)))
    f = np.fft.rfftfreq(16 * len(change), 0.01)
    near = (f > 2.0) & (f < 4.0)
    assert f[near][np.argmax(spectrum[near])] == pytest.approx(3.0, abs=0.25)


@pytest.mark.parametrize(
    ("law", "shapes"),
    [(Law.BOUC_WEN, (1e-5, 1.5)), (Law.STOPS, (1e-3,)), (Law.ELASTOPLASTIC, (1e-2,)), (Law.STRIBECK, (0.1, 1, 0.3, 0))],
)
def test_friction_and_hysteresis_only_take_energy_out(law: Law, shapes: tuple[float, ...]) -> None:
    """Work over whole cycles of a motion back and forth is negative."""
    dt, n = 1e-3, 4000
    phase = 4 * np.pi * np.arange(n) * dt
    scale = {Law.BOUC_WEN: 1e-4, Law.STOPS: 0.02}.get(law, 0.3)
    numbers, memory = np.zeros((1, COLUMNS)), np.zeros((1, STATES))
    numbers[0, :8] = [law, 1, 0.5, 100, 1e4, 15, 0.35, 100]
    numbers[0, 8 : 8 + len(shapes)] = shapes
    work = 0.0
    state, bodies = np.zeros((3, 7)), np.zeros((2, BODY))
    for k in range(n):
        out = np.zeros(OUT)
        column = 5 if law != Law.STOPS else 6
        ratio = 100.0 if law == Law.BOUC_WEN else 1.0
        state[0, column], state[1, column] = (
            ratio * scale * np.sin(phase[k]),
            ratio * scale * 4 * np.pi * np.cos(phase[k]),
        )
        act(k * dt, dt, numbers, memory, state, bodies, out)
        torque = -out[6] / 100.0 if law == Law.BOUC_WEN else out[column]
        work += torque * state[1, column] * dt
    assert work < -0.1 * 0.5 * scale


def test_a_prescribed_field_is_followed() -> None:
    closed = HARDWARE.with_values({"loop": "closed"})
    first = integrate(closed, PATH, time_step=5e-4)
    again = integrate(HARDWARE, PATH, time_step=5e-4, field=first.field)
    np.testing.assert_array_equal(first.wrench, again.wrench)


def test_places_within_what_is_swept() -> None:
    for physics in PHYSICS:
        for shape, value in zip(physics.shapes, drawn(physics.name).shapes, strict=True):
            if isinstance(shape.drawn, Within):
                assert min(low for low, _ in SWEPT.values()) <= value <= max(high for _, high in SWEPT.values())
