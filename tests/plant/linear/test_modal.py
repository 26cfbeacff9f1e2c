"""Modal models: the linear plant against the compiled one, completeness, both ways on the transducer, filter error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kbs_process.plant.attach import attach
from kbs_process.plant.compiled.compile import compiled_plant
from kbs_process.plant.compiled.equilibrium import at_rest
from kbs_process.plant.compiled.generate import state_layout
from kbs_process.plant.laws import CATALOGUE, select
from kbs_process.plant.linear.linearise import linearise
from kbs_process.plant.linear.modal import ModalModel, ModalTable, derive, respond, select_modes, tracked
from kbs_process.plant.schedule import Schedule
from kbs_process.plant.structure import parameters, structure_of
from kbs_process.rig.model import substitute
from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS, Array, Signal
from kbs_process.stages.bandpass import Band
from kbs_process.stages.resonance import amplification, filter_errors, transmit
from kbs_process.studies.correlate.transducer import rigid_base
from kbs_process.studies.stability.onset import smooth_rig
from plant.plant_rigs import NOMINAL, streams, two_axis

POSE = np.array([0.3, np.radians(70.0)])
EFFECTS = select(NOMINAL)


def one_mode(frequency: float = 4.0, damping: float = 0.02, sigma: float = 0.0) -> ModalTable:
    """A table of one pose and one mode about y that takes all of the torque."""
    shape, participation = np.zeros((6, 1)), np.zeros((6, 1))
    participation[4], shape[4] = 2.0, 0.5
    values = (np.array([x]) for x in (frequency, sigma, damping, 0.0))
    return ModalTable("el", (ModalModel(0.0, *values, shape, participation, np.zeros((6, 1))),), "test")


def load_of(values: Array, dt: float) -> Signal:
    padded = np.zeros((len(values), 6))
    padded[:, 4] = values
    return Signal(0.0, dt, padded, WRENCH_CHANNELS, WRENCH_UNITS, "T", np.ones(len(values), dtype=np.bool_))


# Without gravity nothing sags, and the two are the same; with it the pose does by 2e-3 rad.
@pytest.mark.parametrize(("gravity", "tolerance"), [(0.0, 1e-5), (9.80665, 6e-3)])
def test_the_linear_plant_is_the_compiled_one_near_rest(gravity: float, tolerance: float) -> None:
    rig = smooth_rig(two_axis(gravity=gravity))
    system = linearise(rig, EFFECTS, POSE)
    structure = structure_of(rig, EFFECTS)
    p, plant, layout = parameters(rig, structure), compiled_plant(structure), state_layout(structure)
    field = POSE * 100.0 * 12800 / (2.0 * np.pi)
    x, _ = at_rest(plant, structure, p, field)
    free = np.concatenate([np.arange(x.size)[layout[name]] for name in ("alpha", "q", "theta")])
    scale = np.array([1.0] * 5 + [100.0] * 2)  # rotors count as angles at the output

    def moved(step: Array) -> Array:
        trial, acceleration = x.copy(), np.empty(7)
        trial[free] += step * scale
        wrench = np.array(plant.balance(trial, field, p, acceleration))
        return np.concatenate([acceleration[:5], wrench])

    slopes = np.stack([(moved(1e-6 * e) - moved(-1e-6 * e)) / 2e-6 for e in np.eye(7)], axis=1)
    accelerations = -np.linalg.solve(system.M, system.K)
    wrench = system.gravity - system.momentum @ accelerations
    assert np.linalg.norm(slopes[:5] - accelerations[:5]) < tolerance * np.linalg.norm(accelerations[:5])
    assert np.linalg.norm(slopes[5:] - wrench) < tolerance * np.linalg.norm(wrench)


def test_gravity_softens_the_plate_by_weight_times_height() -> None:
    rig = two_axis()
    heavy = linearise(rig, EFFECTS, POSE).K
    light = linearise(substitute(rig, {"gravity.magnitude": 0.0}), EFFECTS, POSE).K
    height = 8.0 * 0.06 + 6.0 * 0.20 + 14.0 * (0.22 + 0.07 * np.sin(POSE[1]) - 0.02 * np.cos(POSE[1]))
    assert (heavy - light)[0, 0] == pytest.approx(-9.80665 * height, rel=1e-9)


def test_effective_inertias_add_up_to_the_whole_and_gains_to_one() -> None:
    rig = two_axis()
    model = derive(rig, EFFECTS, "el", POSE[1:], POSE, highest_Hz=np.inf).models[0]
    whole = linearise(rig, EFFECTS, POSE).M[:3, :3]
    assert np.allclose(model.participation[3:] @ model.participation[3:].T, whole, rtol=1e-9)
    assert np.allclose(model.participation[3:] @ model.shape[3:].T, np.eye(3), atol=1e-9)
    assert np.allclose(model.transfer(np.zeros(1))[0, 3:, 3:], np.eye(3), atol=0.02)  # gravity alone


def test_both_ways_agree_in_a_linear_plant() -> None:
    rig = smooth_rig(two_axis(gravity=0.0))
    t = np.arange(0.0, 24.0, 0.1)
    position = np.tile(POSE, (len(t), 1))
    rng = np.random.default_rng(3)
    position[20:200] += np.cumsum(rng.normal(0.0, 2e-5, (180, 2)), axis=0)
    position[200:] = position[199]
    schedule = Schedule(t, position, np.zeros_like(position))
    rate = 500.0
    settings = {"rate_Hz": rate, "angle_rate_Hz": rate, "duration_s": 24.0, "quantise": False}
    coupled = streams(rig, NOMINAL, schedule, **settings)
    rigid = streams(rigid_base(rig), NOMINAL, schedule, **settings)
    table = derive(rig, EFFECTS, "el", np.radians([69.0, 71.0]), POSE, highest_Hz=np.inf)
    modal = respond(rigid["wrench"], 1.0 / rate, rigid["angle"][:, 1], table)
    low = np.abs(np.fft.rfftfreq(len(modal), 1.0 / rate)) < 15.0

    def below(values: Array) -> Array:
        return np.fft.irfft(np.fft.rfft(values, axis=0) * low[:, None], len(values), axis=0)

    # Tz turns with the azimuth drive, whose damping couples its modes: modal damping leaves that out.
    for column, tolerance in ((0, 0.03), (3, 0.03), (4, 0.03), (5, 0.1)):
        one, other, base = (below(w)[:, column] for w in (coupled["wrench"], modal, rigid["wrench"]))
        assert np.std(one - other) < tolerance * np.std(one)
        assert np.std(one - base) > 0.5 * np.std(one)  # the transducer's answer is most of it


def test_the_response_of_one_mode_is_that_of_an_oscillator() -> None:
    table, dt = one_mode(), 0.01
    t = np.arange(0.0, 60.0, dt)
    load = np.zeros((len(t), 6))
    load[:, 4] = np.sin(2.0 * np.pi * 3.0 * t)
    answer = respond(load, dt, np.zeros(len(t)), table)[3000:5000, 4]
    r = 3.0 / 4.0
    gain = abs((1.0 + 2j * 0.02 * r) / (1.0 - r**2 + 2j * 0.02 * r))
    assert np.sqrt(2.0) * np.std(answer) == pytest.approx(gain, rel=2e-3)
    assert abs(table.at(0.0).transfer(np.array([3.0]))[0, 4, 4]) == pytest.approx(gain, rel=1e-3)


def test_a_mode_that_moves_is_followed() -> None:
    slow, fast = one_mode(3.0).models[0], replace(one_mode(5.0).models[0], angle=1.0)
    table = ModalTable("el", (slow, fast), "test")
    assert table.at(0.25).frequency[0] == pytest.approx(3.5)
    assert table.at(7.0).frequency[0] == 5.0


def test_modes_are_tracked_through_a_crossing_and_a_change_of_sign() -> None:
    def model(angle: float, order: list[int], sign: float) -> ModalModel:
        shapes = sign * np.vstack([np.zeros((3, 2)), np.eye(3)[:, :2]])
        numbers = np.array([4.0 + angle, 5.0 - angle])
        plain = ModalModel(angle, numbers, *(np.zeros(2),) * 3, shapes, shapes, np.zeros((6, 2)))
        return select_modes(plain, np.array(order, dtype=np.intp))

    followed = tracked([model(0.0, [0, 1], 1.0), model(1.0, [1, 0], -1.0)])
    assert np.allclose(followed[1].frequency, [5.0, 4.0])
    assert np.allclose(followed[1].participation, followed[0].participation)


def test_filter_error_is_amplification_below_the_edge_and_leak_above() -> None:
    dt, table = 0.05, one_mode(4.0, 0.01, sigma=0.01)
    t = np.arange(0.0, 200.0, dt)
    band = Band("lt2Hz", 0.01, 2.0)
    low = load_of(np.sin(2.0 * np.pi * 1.0 * t), dt)
    (error,) = filter_errors(transmit(low, 0.0 * t, table), [band])
    growth = 1.0 / (1.0 - 1.0 / 16.0) - 1.0
    assert error.error_rms[4] / error.rigid_rms[4] == pytest.approx(growth, rel=0.02)
    # d(growth)/df = 2 r^2 / f / (1 - r^2)^2
    slope = 2.0 / 16.0 / 4.0 / (1.0 - 1.0 / 16.0) ** 2
    assert error.error_rms_sigma[4] / error.rigid_rms[4] == pytest.approx(0.01 * slope, rel=0.05)
    assert error.leak_rms[4] < 0.05 * error.error_rms[4]
    at_resonance = load_of(np.sin(2.0 * np.pi * 4.0 * t), dt)
    (leak,) = filter_errors(transmit(at_resonance, 0.0 * t, table), [band])
    assert leak.leak_rms[4] == pytest.approx(leak.error_rms[4], rel=0.1)
    assert leak.transmitted_rms[4] > 20.0 * leak.rigid_rms[4]


def test_amplification_has_the_sigma_of_its_mode() -> None:
    (entry,) = amplification(one_mode(4.0, 0.01, sigma=0.1), np.zeros(1), [2.0])
    assert entry.gain[1] == pytest.approx(1.0 / (1.0 - 0.25), rel=1e-3)
    assert entry.sigma[1] == pytest.approx(0.1 * 2.0 * 0.25 / 4.0 / 0.75**2, rel=0.06)
    assert entry.gain[0] == pytest.approx(1.0)


def test_a_cable_that_stiffens_is_as_stiff_as_at_the_pose() -> None:
    effect = next(one for one in CATALOGUE if one.name == "ground_cable")
    rig = attach(two_axis(), effect, {"cable_cubic": 10.0, "cable_middle": 0.0}, joints=["el"])
    plain, q = two_axis(), np.radians([0.0, 80.0])
    bare, hung = linearise(plain, select(NOMINAL), q), linearise(rig, select([*NOMINAL, "ground_cable"]), q)
    added = hung.K - bare.K
    expected = 3.0 * 10.0 * q[1] ** 2
    assert added[bare.output("el"), bare.output("el")] == pytest.approx(expected, rel=1e-4)
    axis = (hung.gravity - bare.gravity)[3:, bare.output("el")]
    assert np.linalg.norm(axis) == pytest.approx(expected, rel=1e-4)
