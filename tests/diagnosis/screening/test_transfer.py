"""The linear plant along a trajectory against the real one: a small effect at every port, by differences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, predict
from kbs_process.diagnosis.screening.inlets import Inlet
from kbs_process.diagnosis.screening.scene import Scene, rebinned
from kbs_process.diagnosis.screening.signature import inputs
from kbs_process.diagnosis.screening.suspects import Candidate, points_of
from kbs_process.diagnosis.screening.transfer import amplified, respond
from kbs_process.plant.attach import attach
from kbs_process.plant.effect import SIGNALS, Effect, Port
from kbs_process.plant.laws import CATALOGUE, select
from kbs_process.plant.linear.linearise import drive_damping
from kbs_process.rig.model import Amplifier, Drive, Quantity, Rig, substitute
from kbs_process.signals.records import WRENCH_CHANNELS, Array

pytestmark = pytest.mark.slow

NOISE = np.array([0.02] * 3 + [0.002] * 3 + [1.1e-4] * 2)  # of EL089's sensors
# Effect, site, shape, the amplitude that is tried and its size: some ten times what a floor shows; bound of the error.
CASES = [
    ("motor_order", "el", {"order": 20.0}, "order_sin", 2e-3, 0.15),
    ("friction_ripple", "el", {"ripple_order": 20.0}, "ripple_sin", 3e-3, 0.5),
    ("kinematic_error", "az", {"kinematic_order": 8.0}, "kinematic_sin", 5e-5, 0.05),
    ("joint_order", "el", {"joint_order": 150.0}, "joint_sin", 0.2, 0.08),
    ("ground_cable", "el", {}, "cable_spring", 0.5, 0.06),
    ("bungee", "el", {"anchor_x": 0.1, "anchor_y": 0.0, "anchor_z": 2.0, "free_length": 1.2}, "stiffness", 0.5, 0.03),
    ("air_drag", "el", {}, "air_drag", 0.5, 0.15),
    ("base_hardening", "T", {"base_hardening_power": 2.0}, "base_hardening_y", 3e-3, 0.15),
    ("base_hardening", "T", {"base_hardening_power": 4.0}, "base_hardening_x", 3e-4, 0.15),
    ("base_hysteresis", "T", {"base_slip_angle": 3e-5}, "base_loop_y", 4e-4, 0.15),
    ("base_hysteresis", "T", {"base_slip_angle": 7e-6}, "base_loop_x", 5e-5, 0.2),
]  # fmt: skip


def suspect(name: str, site: str, shape: dict[str, float]) -> Candidate:
    effect = next(one for one in CATALOGUE if one.name == name)
    middle = {p.name: p.prior.middle for p in effect.parameters if p.role == "shape"} | shape
    return Candidate(effect, site, tuple(middle.items()), points_of(effect, bench.rig(), site)[-1])


@pytest.fixture(scope="module")
def scene() -> Scene:
    """The rig with all cases' effects in it, none of them acting: one plant serves them all."""
    made = bench.experiment(bench.rig(), ("fit",), 1)
    rig, names = made.rig, [*made.effects]
    for name, site, shape, *_ in CASES:
        candidate = suspect(name, site, shape)
        assert isinstance(candidate.effect, Effect)
        rig = acting(rig, candidate, {})
        names.append(name)
    hypothesis = Hypothesis(rig, tuple(one.name for one in select(names)))
    return Scene.of(made, hypothesis, {0: predict(hypothesis, made, 0)})


def acting(rig: Rig, candidate: Candidate, amplitudes: dict[str, float]) -> Rig:
    effect, values = candidate.effect, dict(candidate.shape) | amplitudes
    assert isinstance(effect, Effect)
    if effect.port.of_drive:
        return attach(rig, effect, values, joints=[candidate.site])
    values |= {p.name: 0.0 for p in effect.parameters if p.role == "amplitude" and p.name not in values}
    return attach(rig, effect, values, on=candidate.site, point=np.array(candidate.point))


def whitened(x: Array) -> Array:
    """(b, c) below 8 Hz, tapered, over the sensors' noise."""
    spectrum = np.fft.rfft(x * np.hanning(len(x))[:, None] / NOISE, axis=0)
    f = np.fft.rfftfreq(len(x), bench.DT)
    return np.asarray(spectrum[(f > 0.05) & (f < 8.0)])


def along_trajectory(scene: Scene, columns: list[dict[Inlet, Array]]) -> Array:
    path = scene.paths[0]
    n = scene.experiment.drives[0].n
    found = respond(path, [scene.stepped(0, c) for c in columns], WRENCH_CHANNELS, round(path.rate * bench.DT), n)
    return np.asarray(found)


@pytest.mark.parametrize(("name", "site", "shape", "amplitude", "size", "bound"), CASES, ids=[c[0] for c in CASES])
def test_signature_is_that_of_the_real_plant(
    scene: Scene, capsys: pytest.CaptureFixture[str], name: str, site: str, shape: dict[str, float],
    amplitude: str, size: float, bound: float,
) -> None:  # fmt: skip
    candidate = suspect(name, site, shape)
    hypothesis = scene.hypothesis
    index = [entry.name for entry in candidate.amplitudes].index(amplitude)
    columns = inputs(candidate, scene.signals[0], hypothesis.rig, hypothesis.effects)
    linear = whitened(size * along_trajectory(scene, columns)[:, :, index])
    rig = acting(hypothesis.rig, candidate, {amplitude: size})
    moved = predict(replace(hypothesis, rig=rig), scene.experiment, 0)
    real = whitened(moved.values - scene.predicted[0].values)
    error = np.linalg.norm(linear - real) / np.linalg.norm(real)
    with capsys.disabled():
        print(
            f"\n{str(candidate.port.name).lower()}, {name}: relative error of the whitened signature {error:.3f}",
            end="",
        )
    assert error < bound


def test_floor_acceleration_is_the_masses_reaction(scene: Scene) -> None:
    """A floor that is pushed slowly: the transducer feels all masses, the joints hardly move."""
    n = len(scene.signals[0].values)
    t = np.arange(n) / scene.signals[0].rate
    push = 0.01 * np.sin(2.0 * np.pi * 0.25 * t) * np.hanning(n)
    found = along_trajectory(scene, [{Inlet("base_acceleration", "", axis): push} for axis in "xyz"])
    mass = sum(float(body.mass) for body in scene.hypothesis.rig.bodies)
    at = np.interp(np.arange(found.shape[0]) * bench.DT, t, push)
    for axis in range(3):
        assert np.allclose(found[:, axis, axis], -mass * at, atol=0.04 * mass * np.max(np.abs(push)))


def test_external_force_shows_at_the_transducer_and_winds_up_the_joint(scene: Scene) -> None:
    steady = np.ones(len(scene.signals[0].values))
    found = along_trajectory(
        scene, [{Inlet("external_wrench", "el", "Tx"): steady}, {Inlet("joint_torque", "el"): steady}]
    )
    assert found[100:-100, 3, 0] == pytest.approx(1.0, abs=0.05)
    drive = scene.hypothesis.rig.joint("el").drive
    assert drive is not None
    motor = float(drive.parameters["Tmax"]) * float(drive.parameters["Kangle"]) * float(drive.ratio) ** 2
    windup = 1.0 / float(drive.parameters["Ka"]) + 1.0 / motor
    middle = slice(150, 200)
    assert np.mean(found[middle, 7, 1]) == pytest.approx(windup, rel=0.02)


def test_means_are_kept_by_another_rate() -> None:
    means = np.random.default_rng(1).standard_normal(700)
    assert rebinned(means, 500.0, 100.0, 140) == pytest.approx(means.reshape(140, 5).mean(axis=1))
    whole = rebinned(means, 150.0, 100.0, 400)
    assert np.sum(whole) / 100.0 == pytest.approx(np.sum(means[:600]) / 150.0)


def test_amplifier_is_butterworth() -> None:
    for order in (1, 2, 3):
        corner = Quantity("c", np.asarray(20.0), "Hz", np.asarray(0.0), "test")
        response = amplified(Amplifier(order, corner), np.array([0.0, 10.0, 20.0]))
        assert np.abs(response) == pytest.approx((1.0 + (np.array([0.0, 10.0, 20.0]) / 20.0) ** (2 * order)) ** -0.5)
        assert np.angle(response[1]) < 0.0


def test_friction_that_pushes_at_some_angles_does_not_make_the_linear_plant_run_away() -> None:
    """A fluctuation greater than the mean, as a refit may have it: the real motor goes on, carried by its field."""
    made = bench.experiment(bench.rig(), ("fit",), 1)
    drives = [joint.drive for joint in made.rig.joints if joint.drive is not None]
    pushing = {
        f"joint.{j.name}.drive.d1": 3.0 * float(d.parameters["d0"])
        for j, d in zip(made.rig.joints, drives, strict=True)
    }
    hypothesis = Hypothesis(substitute(made.rig, pushing), made.effects)
    along = Scene.of(made, hypothesis, {0: predict(hypothesis, made, 0)})
    path = along.paths[0]
    assert np.isfinite(along.predicted[0].values).all()
    assert max(abs(np.linalg.eigvals(step)).max() for step in path.step) < 1.0
    shown = along_trajectory(along, [{Inlet("motor_torque", "az"): np.ones(len(along.signals[0].values))}])
    assert 0.0 < np.abs(shown).max() < 1e3


def test_damping_over_a_change_of_rate_is_the_secant() -> None:
    drive = bench.rig().joint("el").drive
    assert drive is not None
    effects = select(bench.effects())
    at = dict.fromkeys(SIGNALS, 0.0) | {"rotor_rate": 0.3}
    reach = {"rotor_rate": 0.5}
    ends = [
        drive_torque(drive, effects, at | {"rotor_rate": at["rotor_rate"] + sign * reach["rotor_rate"]})
        for sign in (1.0, -1.0)
    ]
    expected = -(float(drive.ratio) ** 2) * (ends[0] - ends[1]) / (2.0 * reach["rotor_rate"])
    gear = drive_damping(drive, effects, at, reach)[0, 1]
    assert drive_damping(drive, effects, at, reach)[1, 1] + gear == pytest.approx(expected, rel=1e-9)


def drive_torque(drive: Drive, effects: Sequence[Effect], at: dict[str, float]) -> float:
    """On the rotor, without friction that holds."""
    known = at | {k: float(q) for k, q in drive.parameters.items()} | {"ratio": float(drive.ratio)}
    return sum(effect.value(known)[0] for effect in effects if effect.port is Port.MOTOR_TORQUE)
