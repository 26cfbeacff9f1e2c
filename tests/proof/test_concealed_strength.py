"""The metric: noise is white in it, known parameters are absorbed, steps do not matter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from engine.hardware import Array, Hardware
from engine.laboratory import Laboratory
from engine.ports import NONE
from engine.sensors import coloured
from engine.simulation import integrate
from engine.trajectories import Axis, commands
from proof.concealed import effects, sensitivity
from proof.concealed.bench import Bench, measure, scaled
from proof.concealed.effects import BY_NAME
from proof.concealed.observed import FINE_HZ, Motion, read, to_working_rate
from proof.concealed.physics import Effect
from proof.concealed.recording import record
from proof.concealed.strength import Strength, Whitening, strength

pytestmark = pytest.mark.slow

CAMPAIGN = Path(__file__).parents[2] / "campaigns" / "EL089"
HARDWARE = Hardware.from_campaign(CAMPAIGN, seed=5)
PATH = commands(
    Axis(10.0).rest(1.0).accelerate(0.4, 0.2).accelerate(-0.4, 0.2),
    Axis(70.0).rest(1.0).accelerate(0.5, 0.15).rest(2.0),
    10.0,
)


@cache
def bench() -> Bench:
    """The metric with those parameters of the drives that matter here, which is quicker."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sensitivity, "DRIVE", ("tcog", "Ka", *sensitivity.RUN_FRICTION))
        return measure(HARDWARE, [PATH, PATH], (100.0, 50.0))


def test_noise_of_the_sensors_is_white() -> None:
    rng = np.random.default_rng(1)
    n = 20000
    noise = HARDWARE["transducer.noise"] * coloured(rng, n, FINE_HZ)
    step = HARDWARE["transducer.resolution"]
    readings = to_working_rate(np.hstack([np.round((noise + 5.0) / step) * step - 5.0, np.zeros((n, 2))]))
    entries = Whitening.of(HARDWARE, readings, FINE_HZ, 50.0)(readings).reshape(-1, 8)[:, :6]
    lost = np.mean(np.square(Whitening.of(HARDWARE, readings, FINE_HZ, 50.0).window[:, 0]))  # by the taper
    assert np.mean(np.square(entries)) / lost == pytest.approx(1.0, abs=0.08)


def test_repeats_differ_by_the_floor() -> None:
    t = np.arange(0.0, PATH.t[-1] + 1e-9, 1.0 / FINE_HZ)

    def wrench(seed: int) -> Array:
        run = np.random.SeedSequence(seed)
        stream = record(HARDWARE, PATH, NONE, seed=run, epoch_ns=0, wrench_hz=100.0, encoder_hz=50.0).wrench
        values = np.column_stack([np.interp(t, 1e-9 * stream.stamp, column) for column in stream.values.T])
        return to_working_rate(np.hstack([values, np.zeros((len(t), 2))]))

    setting = bench().settings[0]
    difference = setting.whiten((wrench(1) - wrench(2)) / np.sqrt(2.0))
    raw, left = (entries.reshape(-1, 8)[:, :6] for entries in (difference, setting.above_floor(difference)))
    assert np.mean(raw**2) > 1.5  # bias, friction, clocks
    assert np.mean(left**2) == pytest.approx(0.92, abs=0.15)  # 0.94 by the taper


def test_known_parameters_are_absorbed_and_what_is_beyond_is_not() -> None:
    """A parameter by one sigma keeps sqrt(1/(1 + rho^2)) of its distance, if nothing else looks like it."""
    setting = bench().settings[0]
    for name in (
        ("joint.el.drive.Ka", 0),
        ("joint.el.drive.tcog", 0),
        ("transducer.stiffness", 1),
        ("body.antenna.cog", 0),
    ):
        change = setting.whiten(bench().columns[0][name])
        found = strength(bench().settings, [change])
        assert found.rho_eff < 1.0
        assert found.rho > 5.0 and found.kappa > 0.9, name


def test_an_inertia_changes_how_the_whole_rings() -> None:
    """Along smooth motion alone an inertia hardly shows; its column is what a simulation with another one does."""
    setting, name = bench().settings[0], ("body.antenna.inertia", 1)
    sigma = float(HARDWARE.sigmas[name[0]][name[1]])
    moved = sensitivity.perturbed(HARDWARE, name, 0.1 * sigma)
    change = setting.whiten(setting.motion.observed(moved) - bench().readings[0]) / 0.1
    column = setting.whiten(bench().columns[0][name])
    assert np.linalg.norm(change - column) < 0.2 * np.linalg.norm(column)
    above_2_Hz = column.reshape(2, -1, 8)[:, 20:]  # entries are 0.1 Hz apart
    assert np.linalg.norm(above_2_Hz) > 0.9 * np.linalg.norm(column) > 1.0


def test_the_engines_own_error_is_far_below_the_weakest_effect() -> None:
    setting = bench().settings[0]
    coarse, fine = (
        read(HARDWARE, integrate(HARDWARE, PATH, time_step=step, field=setting.motion.field)) for step in (1e-4, 5e-5)
    )
    assert strength(bench().settings, [setting.whiten(coarse - fine)]).rho < 2.0


@pytest.mark.parametrize("name", ["cogging of another shape", "mass on a spring", "interpolation of the code"])
def test_strength_does_not_depend_on_the_step(name: str) -> None:
    effect = effects.draw(BY_NAME[name], np.random.default_rng(3), "development", {})
    coarse, fine = (at_step(step).strength([effect]).rho for step in (5e-4, 2e-4))
    assert coarse == pytest.approx(fine, rel=0.1)


@cache
def at_step(step: float) -> Bench:
    """The bench with its metric as it is and its motion at another step."""
    motion = Motion.of(HARDWARE, PATH, step)
    setting = replace(bench().settings[0], motion=motion)
    return replace(bench(), settings=(setting,), readings=(motion.observed(),))


def test_the_amplitude_found_has_the_strength_asked_for() -> None:
    effect = effects.draw(BY_NAME["interpolation of the code"], np.random.default_rng(3), "development", {})
    found = scaled(bench(), effect, 100.0)
    assert found is not None
    hidden, strength_of_it, level = found
    assert level == 100.0 and strength_of_it.rho_eff == pytest.approx(100.0, rel=0.25)
    twice = bench().strength([hidden.scaled(2 * hidden.amplitude)])
    assert twice.rho_eff == pytest.approx(2 * strength_of_it.rho_eff, rel=0.01)


def test_what_cannot_reach_its_level_gets_a_weaker_one_or_none() -> None:
    effect = effects.draw(BY_NAME["interpolation of the code"], np.random.default_rng(3), "development", {})
    found = scaled(bench(), effect, 300.0)
    assert found is not None
    for share, expected in ((2.0, 300.0), (0.6, 100.0), (0.2, 40.0), (0.05, None)):
        bounded = replace(effect, physics=replace(effect.physics, most=share * found[0].amplitude))
        weaker = scaled(bench(), bounded, 300.0)
        assert (None if weaker is None else weaker[2]) == expected


def test_what_a_rig_cannot_stand_is_not_asked_of_it() -> None:
    effect = effects.draw(BY_NAME["interpolation of the code"], np.random.default_rng(3), "development", {})
    plain = scaled(bench(), effect, 300.0)
    assert plain is not None
    most = 0.6 * plain[0].amplitude

    class Fragile(Bench):
        def strength(self, hidden: Sequence[Effect]) -> Strength:
            if hidden[0].amplitude > most:
                raise FloatingPointError("no static equilibrium")
            return super().strength(hidden)

    sound = bench()
    weaker = scaled(Fragile(**{one.name: getattr(sound, one.name) for one in fields(sound)}), effect, 300.0)
    assert weaker is not None and weaker[2] == 100.0 and weaker[0].amplitude <= most


NOISY = Laboratory(floor=3e-4, tilt=3e-6, joints=2e-3, motors=5e-5)


@cache
def noisy() -> Bench:
    """The metric in a noisy laboratory."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sensitivity, "DRIVE", ("tcog", "Ka", *sensitivity.RUN_FRICTION))
        return measure(HARDWARE, [PATH, PATH], (100.0, 50.0), laboratory=NOISY, rng=np.random.default_rng(8))


def test_what_another_realisation_of_the_laboratory_makes_is_white() -> None:
    setting = noisy().settings[0]
    rng = np.random.default_rng(9)
    powers, raw = [], []
    for _ in range(4):
        extra = replace(NONE, disturbance=NOISY.disturbance(float(PATH.t[-1]), rng))
        change = setting.motion.observed(extra=extra) - noisy().readings[0]
        powers.append(np.mean(setting.whiten(change) ** 2))
        raw.append(np.mean(bench().settings[0].whiten(change) ** 2))
    assert np.mean(raw) > 20.0
    assert setting.whiten.common is not None
    of_sensors = np.mean(np.sum(np.abs(np.linalg.inv(setting.whiten.common)) ** 2, axis=2))
    assert np.mean(powers) + of_sensors == pytest.approx(1.0, abs=0.1)


def test_an_effect_that_rings_is_weaker_in_a_noisy_laboratory() -> None:
    effect = effects.draw(BY_NAME["cogging of another shape"], np.random.default_rng(3), "development", {})
    quiet, loud = (one.strength([effect]) for one in (bench(), noisy()))
    assert loud.rho < 0.7 * quiet.rho


def test_repeats_in_a_noisy_laboratory_differ_by_its_floor() -> None:
    t = np.arange(0.0, PATH.t[-1] + 1e-9, 1.0 / FINE_HZ)

    def readings(seed: int) -> Array:
        run = np.random.SeedSequence(seed)
        made = record(HARDWARE, PATH, NONE, seed=run, epoch_ns=0, wrench_hz=100.0, encoder_hz=50.0, laboratory=NOISY)
        columns = [
            np.interp(t, 1e-9 * one.stamp, column) for one in (made.wrench, made.encoder) for column in one.values.T
        ]
        return to_working_rate(np.column_stack(columns))

    setting, power = noisy().settings[0], np.zeros(8)
    for seed in range(6):
        difference = (readings(2 * seed) - readings(2 * seed + 1)) / np.sqrt(2.0)
        power += np.mean(setting.above_floor(setting.whiten(difference)).reshape(-1, 8) ** 2, axis=0) / 6
        assert np.mean(bench().settings[0].whiten(difference) ** 2) > 100.0
    assert power[:6] == pytest.approx(np.full(6, 0.92), abs=0.3)  # 0.94 by the taper
