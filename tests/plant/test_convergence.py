"""What the step costs in accuracy, in units of the sensors' noise, and that a run repeats to the last bit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from engine import TRAJECTORIES
from kbs_process.plant.attach import attach
from kbs_process.plant.effect import Effect
from kbs_process.plant.laws.hysteresis.dahl import TRANSMISSION_HYSTERESIS
from kbs_process.plant.laws.hysteresis.lugre import LUGRE
from kbs_process.plant.predict import DEFAULT_STEP
from kbs_process.plant.schedule import Schedule
from kbs_process.signals.records import Array
from plant.plant_rigs import CODE, NOMINAL, streams, two_axis

pytestmark = pytest.mark.slow

NOISE = np.array([0.02] * 3 + [0.002] * 3)  # rms a sample


def commanded(name: str, until: float) -> Schedule:
    commands = TRAJECTORIES[name]().until(until)
    return Schedule(commands.t, commands.position, commands.rate)


def steady(degrees_a_second: float, until: float) -> Schedule:
    """Both axes from rest to a constant rate, elevation at 0.7 of azimuth's."""
    t = np.arange(0.0, until + 0.25, 0.1)
    rate = np.radians([degrees_a_second, 0.7 * degrees_a_second])
    return Schedule(t, np.array([0.3, 1.2]) + np.outer(t, rate), np.tile(rate, (len(t), 1)))


def run(schedule: Schedule, until: float, step: float, rate: float = 100.0, **settings: Any) -> dict[str, Array]:
    return streams(
        two_axis(**settings), NOMINAL, schedule, rate_Hz=rate, angle_rate_Hz=20.0, duration_s=until, step_s=step,
        quantise=False,
    )  # fmt: skip


def error(of: dict[str, Array], reference: dict[str, Array]) -> tuple[Array, float]:
    """Error of the wrench, rms a channel, in noise rms, and the angles' greatest, in codes."""
    wrench = np.sqrt(((of["wrench"] - reference["wrench"]) ** 2).mean(axis=0)) / NOISE
    return wrench, float(np.abs(of["angle"] - reference["angle"]).max() / CODE)


# At 0.06 deg/s microsteps come at the rotors' resonance, at 0.14 deg/s at one in a step, below at the edge of sticking.
CASES: dict[str, tuple[Schedule, float, dict[str, Any]]] = {
    "EL089, open loop": (commanded("EL089P00", 90.0), 90.0, {}),
    "EL089, closed loop": (commanded("EL089P00", 75.0), 75.0, {"loop": "closed"}),
    "EL089, rigid base": (commanded("EL089P00", 75.0), 75.0, {"stiffness": None}),
    "singularity": (commanded("AESING00", 60.0), 60.0, {}),
    "azimuth at 2 deg/s": (commanded("AL012M00", 25.0), 25.0, {}),
    "tracking at 0.001 deg/s": (steady(0.001, 10.0), 10.0, {}),
    "tracking at 0.01 deg/s": (steady(0.01, 10.0), 10.0, {}),
    "steady 0.06 deg/s": (steady(0.06, 8.0), 8.0, {}),
    "steady 0.14231 deg/s": (steady(0.14231, 15.0), 15.0, {}),
    "steady 0.3 deg/s": (steady(0.3, 8.0), 8.0, {}),
}


@pytest.mark.parametrize("case", CASES)
def test_step_costs_less_than_a_tenth_of_the_noise(case: str) -> None:
    schedule, until, settings = CASES[case]
    reference = run(schedule, until, DEFAULT_STEP / 10, **settings)
    print(f"\n{case}: error against a step of {1e3 * DEFAULT_STEP / 10} ms; wrench rms in % of the noise")
    for factor in (2.0, 1.0, 0.5):
        wrench, angle = error(run(schedule, until, factor * DEFAULT_STEP, **settings), reference)
        shares = " ".join(f"{100 * share:6.2f}" for share in wrench)
        print(f"  {1e3 * factor * DEFAULT_STEP:4.1f} ms: {shares}   angles {angle:.4f} codes")
        if factor <= 1.0:
            assert wrench.max() < 0.1
            assert angle < 0.1


# A joint's bristles of 1.7e4 N m/rad, and a gear's, by a law that names them: where they stick they are a spring.
BRISTLES: dict[str, tuple[Effect, dict[str, float]]] = {
    "joint": (LUGRE, {"lugre": 0.85, "lugre_displacement": 5e-5, "lugre_excess": 0.4, "lugre_rate": 0.02}),
    "gear": (TRANSMISSION_HYSTERESIS, {"windup_loss": 0.16, "windup_memory": 1.5e-5}),
}


@pytest.mark.parametrize("place", BRISTLES)
@pytest.mark.parametrize("rate", [0.01, 0.3])
def test_states_that_follow_an_angle_do_not_drift_from_it(place: str, rate: float) -> None:
    """Bristles that are led along a predicted path alone ring by themselves: 1 to 10 times the noise; 0.6 so."""
    effect, values = BRISTLES[place]
    rig = attach(two_axis(), effect, values, joints=["az"])
    coarse, fine = (
        streams(
            rig, (*NOMINAL, effect.name), steady(rate, 8.0), rate_Hz=100.0, angle_rate_Hz=20.0, duration_s=8.0,
            step_s=step, quantise=False,
        )
        for step in (DEFAULT_STEP, DEFAULT_STEP / 8)
    )  # fmt: skip
    wrench, angle = error(coarse, fine)
    print(f"{place}, {rate} deg/s: wrench rms in % of the noise", (100 * wrench).round(1), f"{angle:.3f} codes")
    assert wrench.max() < 1.0
    assert angle < 0.1


@pytest.mark.parametrize("rate", [0.01, 0.06, 0.3])
def test_amplifier_of_a_fast_recorder_is_fed_finely_enough(rate: float) -> None:
    """At 1 kHz behind a corner of 200 Hz the rotors' own vibration is in the band."""
    schedule = steady(rate, 4.0)
    settings: dict[str, Any] = {"rate": 1000.0, "amplifier": (2, 200.0)}
    coarse = streams(
        two_axis(amplifier=(2, 200.0)), NOMINAL, schedule, rate_Hz=1000.0, angle_rate_Hz=20.0, duration_s=4.0,
        quantise=False,
    )  # fmt: skip
    wrench, _ = error(coarse, run(schedule, 4.0, 5e-5, **settings))
    print(f"1 kHz, {rate} deg/s: wrench rms in % of the noise", (100 * wrench).round(2))
    assert wrench.max() < 0.1


def test_error_falls_with_the_step() -> None:
    schedule, until, settings = CASES["EL089, open loop"]
    reference = run(schedule, until, 1.25e-4, **settings)
    steps = (0.01 / 3, 0.01 / 6, 0.01 / 12, 0.01 / 24)
    errors = [float(error(run(schedule, until, step, **settings), reference)[0][4]) for step in steps]
    print("error of Ty in noise rms:", dict(zip(steps, np.round(errors, 4).tolist(), strict=True)))
    assert errors[1] < 0.3 * errors[0]
    assert errors[2] < 0.5 * errors[1]
    assert errors[3] < 0.7 * errors[2]  # of first order in the end: a tooth's contact begins within a step


def test_same_input_gives_the_same_bits() -> None:
    first, second = (run(commanded("EL089P00", 12.0), 12.0, DEFAULT_STEP) for _ in range(2))
    for key, values in first.items():
        assert values.tobytes() == second[key].tobytes()


def test_blocks_do_not_show(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = run(commanded("EL089P00", 8.0), 8.0, DEFAULT_STEP, loop="closed")
    monkeypatch.setattr("kbs_process.plant.predict.BLOCK_S", 0.37)
    pieces = run(commanded("EL089P00", 8.0), 8.0, DEFAULT_STEP, loop="closed")
    for key, values in whole.items():
        assert values.tobytes() == pieces[key].tobytes()


@pytest.mark.parametrize(("loss", "memory"), [(1.0, 1e-6), (5.0, 5e-6)])
def test_a_gear_far_stiffer_than_a_step_resolves_still_runs(loss: float, memory: float) -> None:
    """To and fro at 0.5 Hz: set right by a slope that holds one way alone, shares left 1, and all diverged."""
    t = np.arange(0.0, 4.05, 0.05)
    size = 0.02 * np.array([1.0, 0.7])
    swing, rate = np.outer((1.0 - np.cos(np.pi * t)) / np.pi, size), np.outer(np.sin(np.pi * t), size)
    values = {"windup_loss": loss, "windup_memory": memory}
    rig = attach(two_axis(), TRANSMISSION_HYSTERESIS, values, joints=["el"])
    found = streams(
        rig, (*NOMINAL, TRANSMISSION_HYSTERESIS.name), Schedule(t, swing, rate), rate_Hz=100.0, angle_rate_Hz=20.0,
        duration_s=4.0, step_s=DEFAULT_STEP, quantise=False,
    )  # fmt: skip
    assert np.abs(found["angle"][:, 1]).max() == pytest.approx(0.028 / np.pi, abs=1e-3)
