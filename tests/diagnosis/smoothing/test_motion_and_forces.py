"""The parts of smoothing against closed forms, and a null that it fits from a cold start."""

from __future__ import annotations

import tarfile
from copy import copy
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from kbs_process.campaign.load import load_campaign
from kbs_process.diagnosis.screening.suspects import Candidate
from kbs_process.diagnosis.smoothing.balance import FIRST_JOINT, FLOOR, PLATE, STILL, needed
from kbs_process.diagnosis.smoothing.basis import BAND_HZ, WHOLE_HZ, Basis, in_band
from kbs_process.diagnosis.smoothing.fit import Quadratic, State, restrained, step
from kbs_process.diagnosis.smoothing.intensities import powers
from kbs_process.diagnosis.smoothing.lines import orders_in, tones_in
from kbs_process.diagnosis.smoothing.problem import Problem
from kbs_process.diagnosis.smoothing.screen import Scored, Screen, evidence
from kbs_process.diagnosis.smoothing.search import can_smooth, settled
from kbs_process.plant.laws import CATALOGUE, SENSING
from kbs_process.plant.rigid import inverse_dynamics, joint_efforts, kinematics, static_wrench
from kbs_process.progress import SilentProgress
from kbs_process.rig.model import substitute
from kbs_process.signals.records import Array
from kbs_process.studies.diagnose.reading import experiment_of

CAMPAIGN = Path(__file__).parents[3] / "campaigns" / "EL089"
NULL = Path(__file__).parents[2] / "proof" / "small" / "T00000000A1.tar"


def test_splines_give_values_rates_and_accelerations() -> None:
    dt, n = 0.05, 200
    t = dt * np.arange(n)
    basis = Basis(n, dt)
    values, rates, accelerations = basis.motion(basis.fitted(np.stack([np.sin(t), t**2], axis=1)))
    inside = slice(65, -65)
    for found, expected in (
        (values, [np.sin(t), t**2]),
        (rates, [np.cos(t), 2 * t]),
        (accelerations, [-np.sin(t), 2 + 0 * t]),
    ):
        assert found[inside] == pytest.approx(np.stack(expected, axis=1)[inside], abs=2e-4)


def test_rates_and_accelerations_are_right_up_to_the_band_s_end() -> None:
    dt, n = 0.05, 600
    t, inside = dt * np.arange(n), slice(100, -100)
    basis = Basis(n, dt)
    for f in (0.5, 2.0, 5.0, 7.0, 8.0):
        w = 2.0 * np.pi * f
        values, rates, accelerations = basis.motion(basis.fitted(np.sin(w * t)[:, None]))
        assert values[inside, 0] == pytest.approx(np.sin(w * t)[inside], abs=1e-4)
        assert rates[inside, 0] == pytest.approx(w * np.cos(w * t)[inside], abs=0.007 * w)
        assert accelerations[inside, 0] == pytest.approx(-(w**2) * np.sin(w * t)[inside], abs=0.007 * w**2)


def test_the_band_ends_so_softly_that_an_equation_holds_of_what_drifts_through_its_end() -> None:
    dt, n = 0.05, 3000
    t, inside = dt * np.arange(n), slice(100, -100)
    f = BAND_HZ - 0.1 + 0.2 * np.sin(2.0 * np.pi * t / 60.0)
    ringing, stiffness = np.sin(2.0 * np.pi * dt * np.cumsum(f))[:, None], (f**2)[:, None]
    left = in_band(stiffness * ringing, dt) - stiffness * in_band(ringing, dt)
    # A hundredth of what a Q of 50 loses; an edge there would leave as much as that.
    assert np.std(left[inside]) < 1e-2 * np.std(stiffness * ringing) / 50.0
    slow, beyond = np.sin(2.0 * np.pi * WHOLE_HZ * t)[:, None], np.sin(2.0 * np.pi * (BAND_HZ + 0.5) * t)[:, None]
    assert in_band(slow, dt)[inside] == pytest.approx(slow[inside], abs=0.01)
    assert np.abs(in_band(beyond, dt)[inside]).max() < 0.01


def test_lines_are_found_at_their_orders_whatever_the_rates_and_at_their_frequencies_whatever_the_phases() -> None:
    dt, rng = 0.05, np.random.default_rng(5)
    angles = [0.02 * np.arange(1500) * dt, 0.7 * np.sin(0.1 * np.arange(1400) * dt)]
    swept = [np.sin(19.7 * angle + 0.4) + rng.standard_normal(len(angle)) for angle in angles]
    assert orders_in(angles, swept, dt, 500.0)[0] == pytest.approx(19.7, abs=0.5)  # a line is four wide
    still = [np.zeros(1500)]
    assert orders_in(still, [rng.standard_normal(1500)], dt, 500.0) == ()
    noise = [np.cumsum(rng.standard_normal((1500, 3)), axis=0) for _ in range(2)]
    for one, phase in zip(noise, (0.0, 2.0), strict=True):
        one[:, 1] += 8.0 * np.sin(2 * np.pi * 1.745 * dt * np.arange(1500) + phase)
    assert tones_in(noise, dt)[0] == pytest.approx(1.745, abs=0.005)


def test_evidence_is_the_likelihood_of_the_best_size_of_amplitudes() -> None:
    gain, freedom = 300.0, 10
    g = np.geomspace(0.1, 1e4, 20001)
    assert evidence(gain, freedom) == pytest.approx(np.max(g * gain / (1 + g) - freedom * np.log1p(g)), rel=1e-6)
    assert evidence(9.0, 10) == 0.0  # amplitudes that mean nothing take as much


@pytest.mark.slow
def test_what_a_motion_needs_is_the_sagged_weight_and_what_the_floor_adds() -> None:
    rig = load_campaign(CAMPAIGN, checksums=False).rig
    assert rig.transducer.stiffness is not None
    q = np.radians([[10.0, 75.0], [-30.0, 82.0]])
    still, x = np.zeros((2, FIRST_JOINT + 2)), np.zeros((2, FIRST_JOINT + 2))
    x[:, FIRST_JOINT:] = q
    rest = (np.zeros((2, 2)), np.zeros((2, 2)))
    for _ in range(4):
        wrench, efforts = needed(rig, (x, still, still), rest)
        x[:, PLATE] = -efforts[:, :3] / rig.transducer.stiffness.value
    assert wrench == pytest.approx(static_wrench(rig, q), abs=1e-4)
    # The mounting carries what the transducer feels, about axes that the plate's small angles hardly turn.
    assert -efforts[:, :3] == pytest.approx(wrench[:, 3:], abs=0.05)
    raised = x.copy()
    raised[:, FLOOR] = [0.0, 0.0, 0.1 / STILL]
    heavier, _ = needed(rig, (raised, still, still), rest)
    assert heavier[:, 2] / wrench[:, 2] == pytest.approx(1 + 0.1 / float(rig.gravity), rel=1e-4)


def test_what_a_motion_needs_is_what_inverse_dynamics_of_the_product_says() -> None:
    rig = load_campaign(CAMPAIGN, checksums=False).rig
    rng = np.random.default_rng(0)
    motion = tuple(0.3 * rng.standard_normal((20, FIRST_JOINT + 2)) for _ in range(3))
    for part in motion:
        part[:, :FIRST_JOINT] = 0.0
    q, rate, acceleration = (part[:, FIRST_JOINT:] for part in motion)
    ratio = np.array([float(joint.drive.ratio) for joint in rig.joints if joint.drive])
    wrench, efforts = needed(rig, motion, (ratio * rate, ratio * acceleration))
    level = replace(rig, transducer=replace(rig.transducer, stiffness=None))
    assert wrench == pytest.approx(inverse_dynamics(level, q, rate, acceleration), abs=1e-9)
    # Of a joint it is what the gear gives: the rotors' own part is the drives'.
    links = kinematics(level, q, rate, acceleration)
    for k, joint in enumerate(rig.joints):
        assert joint.drive is not None
        along = np.sum(links[joint.name].axis * links[joint.parent].alpha, axis=1)
        own = ratio[k] * float(joint.drive.rotor_inertia) * (ratio[k] * acceleration[:, k] + along)
        expected = joint_efforts(level, q, rate, acceleration)[:, k] - own
        assert efforts[:, 3 + k] == pytest.approx(expected, abs=1e-9)


def _null(folder: Path, trials: list[int]) -> Problem:
    with tarfile.open(NULL) as archive:
        archive.extractall(folder / "T", filter="data")
    return Problem(experiment_of(load_campaign(folder / "T", checksums=False), SilentProgress()), trials)


@pytest.mark.slow
def test_a_cold_start_follows_its_readings_after_three_steps(tmp_path: Path) -> None:
    problem = _null(tmp_path, [1])
    state = State.of(problem, np.repeat([0.05, 0.2, 0.01], [3, 2, 3]))
    cold = state.cost(problem)
    for _ in range(3):
        state.idealise(problem, 0.1)
        step(problem, state, Quadratic.of(problem, state), ~problem.dynamic)
    quadratic = Quadratic.of(problem, state)
    # What is left is the cost once motion and unknowns have followed, less what priors pay.
    change = quadratic.solve(problem.spread, quadratic.pull)
    left = quadratic.parts[0].left(0, change[problem.local[0]])
    paid = np.sum(((state.x + change - problem.prior) / problem.spread) ** 2)
    assert np.sum(left**2) + paid == pytest.approx(quadratic.left - quadratic.pull @ change, rel=1e-3)
    numbers = problem.recordings[0].weight.sum() * problem.rows
    assert cold > 1e3 * numbers
    assert state.cost(problem) < 0.5 * numbers  # forces this loose follow some of the noise


@pytest.mark.slow
def test_an_effect_that_joins_is_nothing_until_it_has_a_size_and_then_its_torque(tmp_path: Path) -> None:
    problem = _null(tmp_path, [1])
    state = State.of(problem, np.repeat([0.05, 0.2, 0.01], [3, 2, 3]))
    (viscous,) = (law for law in CATALOGUE if law.name == "joint_viscous")
    wider = problem.joined(Candidate(viscous, "el", ()))
    joined = state.joined(problem, wider)
    assert joined.cost(wider) == pytest.approx(state.cost(problem), rel=1e-12)
    joined.idealise(wider, 0.1)
    motion, torques = joined.ideal_motion(wider, 0), joined.ideal_torques[0]
    (own,) = wider.amplitudes[0]
    rubbing = joined.x.copy()
    rubbing[own] = 2.0  # N m s/rad
    change = wider.predicted(0, rubbing, motion, torques) - wider.predicted(0, joined.x, motion, torques)
    rate, inside = motion[1][:, FIRST_JOINT + 1], slice(30, -30)
    assert np.abs(rate).max() > 1e-3
    assert change[inside, wider.joint.start + 1] == pytest.approx(-2.0 * rate[inside], abs=0.02 * np.abs(rate).max())


@pytest.mark.slow
def test_a_clock_shows_all_that_it_is_late_by(tmp_path: Path) -> None:
    problem = _null(tmp_path, [1])
    state = State.of(problem, np.repeat([0.05, 0.2, 0.01], [3, 2, 3]))
    for _ in range(2):
        state.idealise(problem, 0.1)
        step(problem, state, Quadratic.of(problem, state), ~problem.dynamic)
    state.idealise(problem, 0.01)
    recording, by = problem.recordings[0], 0.4
    t = problem.experiment.dt * np.arange(recording.n)
    then = make_interp_spline(t, recording.reading)(np.clip(t + by, 0.0, t[-1]))
    (offset,) = (law for law in SENSING if law.name == "clock_offset")
    wider = problem.joined(Candidate(offset, "wrench", ()))
    (own,), wrench, inside = wider.amplitudes[0], wider.wrench, slice(40, -40)

    def shown(by: float) -> tuple[Array, Array]:
        joined = state.joined(problem, wider)
        joined.x[own] = by
        slopes, beyond = joined.course(wider, 0).acting()
        return by * slopes[inside, wrench, 0] + beyond[inside, wrench], slopes[inside, wrench, 0]

    # What is read at its own time is what is read so much later, by this clock.
    expected = in_band((recording.reading - then)[:, wrench], recording.dt)[inside]
    assert shown(by)[0] == pytest.approx(expected, abs=1e-3 * np.abs(expected).max())
    change, slope = (shown(by + 1e-3)[0] - shown(by - 1e-3)[0]) / 2e-3, shown(by)[1]
    assert change == pytest.approx(slope, abs=0.01 * np.abs(slope).max())


def test_a_step_takes_numbers_as_far_as_it_may_and_the_rest_all_the_way() -> None:
    spread, rig = np.array([2.0, 0.1, 5.0]), slice(0, 2)
    problem = cast("Problem", SimpleNamespace(spread=spread, of_rig=rig))
    rows = np.array([[1.0, 2.0, 0.3], [0.4, 30.0, 0.1], [0.5, 4.0, 0.2]])
    right = np.array([30.0, 7.0, -40.0])
    quadratic = Quadratic((), np.diag(spread**-2.0) + rows.T @ rows, rows.T @ right, 0.0)
    free = restrained(problem, quadratic, 1e9, None)
    assert quadratic.normal @ free == pytest.approx(quadratic.pull)
    near = restrained(problem, quadratic, 0.5, None)
    assert np.abs(near / spread)[rig].max() == pytest.approx(0.5, rel=1e-3)
    # Whatever the numbers do, what is linear is at its best beside them.
    assert (quadratic.normal @ near - quadratic.pull)[2] == pytest.approx(0.0, abs=1e-9 * np.abs(quadratic.pull).max())
    held = restrained(problem, quadratic, 0.5, np.array([True, False, True]))
    assert held[1] == 0.0


@pytest.mark.slow
def test_an_effect_takes_of_its_own_recording_what_it_was_said_to_take(tmp_path: Path) -> None:
    problem = _null(tmp_path, [1])
    recording = problem.recordings[0]
    t = problem.experiment.dt * np.arange(recording.n)
    recording.reading[:, problem.wrench] = make_interp_spline(t, recording.reading[:, problem.wrench])(t - 0.2)
    state = settled(problem, np.repeat([0.05, 0.2, 0.01], [3, 2, 3]))
    (offset,) = (law for law in SENSING if law.name == "clock_offset")
    common = problem.own[0].start
    problem.prior[:common] = state.x[:common]  # as of recordings held out
    screen = Screen(problem, state)
    (first,) = screen.scored([Candidate(offset, "wrench", ())])
    one = screen.sized(first)
    assert one.gain > 1.5 * first.gain > 30.0  # so late that the readings' slopes do not show it
    stay = replace(one, moved=0.0 * one.moved)
    assert screen.foreseen(stay) == pytest.approx((one.gain, one.gain), rel=0.1)
    assert screen.foreseen(one)[0] == pytest.approx(one.gain, rel=0.1)
    none = replace(one, amplitudes=-one.amplitudes, each=-one.each, moved=-one.moved)
    assert screen.foreseen(none)[0] < -0.5 * one.gain


@pytest.mark.validation
def test_a_null_is_fitted_to_its_noise_and_forces_to_what_repeats_differ_by(tmp_path: Path) -> None:
    problem = _null(tmp_path, [1, 2])
    state = settled(problem)
    left = powers(problem, state)
    assert left.of_repeats is not None
    # Repeats differ by what forces are said to be, and readings by their noise; encoders less than if all were rounded.
    assert left.of_repeats[problem.forces] == pytest.approx(1.0, abs=0.4)
    assert np.all(left.of_repeats[problem.wrench] < 1.2)
    assert np.all(left.of_all[problem.wrench] < 1.5)
    off = np.abs(state.x - problem.prior)[problem.of_rig] / problem.spread[problem.of_rig]
    assert off.max() < 10.0


@pytest.mark.slow
def test_recordings_that_were_driven_alike_have_one_set_of_slopes(tmp_path: Path) -> None:
    problem = _null(tmp_path, [1, 2])
    state = State.of(problem, np.repeat([0.05, 0.2, 0.01], [3, 2, 3]))
    state.idealise(problem, 0.1)
    (offset,) = (law for law in SENSING if law.name == "clock_offset")
    assert problem.groups == [[0, 1]]
    assert problem.joined(Candidate(offset, "wrench", ())).groups == [[0], [1]]
    apart = copy(problem)
    apart.__dict__["_driven_alike"] = [[0], [1]]
    shared, own = Quadratic.of(problem, state), Quadratic.of(apart, state.joined(problem, apart))
    size = np.sqrt(np.diag(own.normal))
    assert (shared.normal - own.normal) / np.outer(size, size) == pytest.approx(0.0, abs=0.01)
    assert shared.left == pytest.approx(own.left, rel=1e-3)
    step, other = (one.solve(problem.spread, one.pull) for one in (shared, own))
    assert (step - other) @ own.normal @ (step - other) < 1e-3 * other @ own.normal @ other


@pytest.mark.slow
def test_effects_that_do_the_same_beside_all_numbers_are_found_to(tmp_path: Path) -> None:
    problem = _null(tmp_path, [1])
    field = problem.recordings[0].field
    field.angle[:, 1] += 0.05 * np.sin(2.0 * field.angle[:, 1])  # which the gear has not followed
    state = settled(problem, np.repeat([0.05, 0.2, 0.01], [3, 2, 3]))
    screen = Screen(problem, state)

    def scored(name: str, site: str, **shape: float) -> Scored:
        (law,) = (one for one in CATALOGUE if one.name == name)
        (found,) = screen.scored([Candidate(law, site, tuple(shape.items()))])
        return found

    # An error of the gear turns the output as a torque of the rotor turns the rotor.
    gear = scored("kinematic_error", "el", kinematic_order=2.0)
    assert gear.gain > 100.0
    assert screen.same(gear, scored("motor_order", "el", order=2.0))
    assert not screen.same(gear, scored("kinematic_error", "az", kinematic_order=2.0))
    assert not screen.same(gear, scored("kinematic_error", "el", kinematic_order=1.0))


@pytest.mark.slow
def test_rigs_that_rows_do_not_describe_are_left_to_the_plant(tmp_path: Path) -> None:
    made = _null(tmp_path, [1]).experiment
    assert can_smooth(made)
    none = np.zeros(6)
    silent = substitute(made.rig, {"transducer.noise": none, "transducer.resolution": none})
    smooth = substitute(made.rig, {"joint.el.encoder.step": 0.0})
    elsewhere = replace(made.rig, transducer=replace(made.rig.transducer, on="az"))
    for rig in (silent, smooth, elsewhere):
        assert not can_smooth(replace(made, rig=rig))
    # A friction that the model has not is none of its numbers.
    assert not can_smooth(replace(made, effects=tuple(one for one in made.effects if one != "dynamic_friction")))


@pytest.mark.slow
def test_what_is_known_exactly_stays(tmp_path: Path) -> None:
    made = _null(tmp_path, [1]).experiment
    names = {"joint.el.encoder.offset": 0.0, "joint.el.drive.b_m": 0.0}
    own = made.rig.quantities()
    rig = substitute(made.rig, {name: own[name].value for name in names}, dict(names))
    problem = Problem(replace(made, rig=rig), [1])
    state = State.of(problem, np.repeat([0.05, 0.2, 0.01], [3, 2, 3]))
    state.idealise(problem, 0.1)
    step(problem, state, Quadratic.of(problem, state), ~problem.dynamic)
    assert np.isfinite(state.x).all()
    assert state.x[problem.offsets][1] == pytest.approx(0.0, abs=1e-9)
