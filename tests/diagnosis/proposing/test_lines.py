"""Lines of a residual along an angle: the power at each order is that of the sum over all samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.jumps import _gain, _telling, jump
from kbs_process.diagnosis.proposing.proposals import _along, proposed
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.identification.output_error import Scalar
from kbs_process.signals.records import Array

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("orders", [np.arange(0.25, 60.0, 0.25), np.arange(7.3, 90.0, 0.61), np.arange(1.0, 3.0)])
def test_power_along_orders_is_that_of_the_sum(orders: np.ndarray) -> None:
    rng = np.random.default_rng(4)
    angle = np.cumsum(rng.normal(0.01, 0.02, 4000)) - 11.0
    line = orders[len(orders) // 2]
    series = rng.standard_normal((4000, 3))
    series[:, 1] += 0.3 * np.sin(line * angle + 0.4)
    x = series / series.std(axis=0)
    expected = np.max(np.abs(np.exp(-1j * np.outer(orders, angle)) @ x) ** 2, axis=1) / len(angle)
    found = _along(orders, angle, series)
    assert orders[found.argmax()] == orders[expected.argmax()] == line
    assert found.max() == pytest.approx(expected.max(), rel=0.03)
    # Noise of other orders, which a cell of the angle adds to each.
    np.testing.assert_allclose(found, expected, atol=0.35 + 0.03 * expected.max())


def test_a_slow_and_a_fast_half_count_alike() -> None:
    """Samples are weighed as they are, wherever they are dense."""
    angle = np.concatenate([np.linspace(0.0, 1.0, 3000), np.linspace(1.0, 12.0, 1000)])
    series = np.cos(5.0 * angle)[:, None]
    orders = np.arange(1.0, 30.0)
    expected = np.abs(np.exp(-1j * np.outer(orders, angle)) @ (series[:, 0] / series.std())) ** 2 / len(angle)
    np.testing.assert_allclose(_along(orders, angle, series), expected, rtol=0.1, atol=0.01 * expected.max())


@pytest.mark.parametrize("bare", [False, True])
def test_lines_of_a_disc_are_its_shape_s_if_few_to_a_turn_and_else_its_grating_s(bare: bool) -> None:
    """What repeats 600 times in a turn is no eccentricity, unless nobody says how fine the code is."""
    made = bench.experiment(bench.rig(), ("fit",), 1, seconds=60.0, bare_encoders=bare)
    trial = made.trials[0]
    el = made.channels.index("el")
    line: Array = np.zeros_like(trial.measured)
    line[:, el] = 2e-5 * np.sin(600.0 * trial.measured[:, el])
    shown = replace(trial, measured=trial.measured + line * trial.valid[:, None])
    held = bench.standing(replace(made, trials=(shown,)), (Scalar("joint.el.drive.Ka"),))
    found = proposed(held.known, Scene.of(held.known.experiment, held.hypothesis, held.predicted))
    if bare:
        assert found["eccentric_order.el"] == pytest.approx([600.0], rel=0.02)
        assert "interpolation_bits.el" not in found
    else:
        encoder = bench.rig().joint("el").encoder
        assert encoder is not None
        lines = [2.0 * np.pi / (float(encoder.step) * 2.0**bits) for bits in found["interpolation_bits.el"]]
        assert lines == pytest.approx([600.0], rel=0.02)  # a turn over the range that is swept
        assert "eccentric_order.el" not in found


def proposals(shown: Array, made: Experiment) -> dict[str, tuple[float, ...]]:
    """What is proposed where the only trial has `shown` beside what the plant predicts."""
    (trial,) = made.trials
    wrong = replace(trial, measured=trial.measured + shown * trial.valid[:, None])
    held = bench.standing(replace(made, trials=(wrong,)), (Scalar("joint.el.drive.Ka"),))
    return proposed(held.known, Scene.of(held.known.experiment, held.hypothesis, held.predicted))


@pytest.fixture(scope="module")
def made() -> Experiment:
    return bench.experiment(bench.rig(), ("fit",), 1, seconds=60.0)


def test_a_tone_between_two_bins_is_put_there(made: Experiment) -> None:
    n = len(made.trials[0].measured)
    apart = 1.0 / (n * made.dt)
    tone = (round(1.3 / apart) + 0.5) * apart
    line = np.zeros_like(made.trials[0].measured)
    line[:, 0] = 0.5 * np.sin(2.0 * np.pi * tone * np.arange(n) * made.dt + 0.3)
    found = proposals(line, made)
    assert found["floor_frequency"][0] == pytest.approx(tone, abs=0.1 * apart)
    assert tone == pytest.approx(found["sway_frequency"][0], abs=0.1 * apart)  # what hangs on a link may ring there


def test_a_line_beside_a_beat_of_the_controller_is_one(made: Experiment) -> None:
    n = len(made.trials[0].measured)
    apart = 1.0 / (n * made.dt)
    assert made.rig.controller is not None
    beat = 3.0 / (16.0 * float(made.rig.controller.cycle))
    line = np.zeros_like(made.trials[0].measured)
    line[:, 0] = 0.5 * np.sin(2.0 * np.pi * (beat + 0.4 * apart) * np.arange(n) * made.dt)
    found = proposals(line, made)
    assert found["jitter_frequency"][0] == pytest.approx(beat, rel=1e-12)
    assert found["floor_frequency"][0] == pytest.approx(beat + 0.4 * apart, abs=0.1 * apart)
    assert found["jitter_frequency"][1] == found["floor_frequency"][0]  # which may be no beat


def test_orders_of_a_motor_are_proposed_for_its_gear_and_its_microsteps_too(made: Experiment) -> None:
    drive = made.rig.joint("az").drive
    assert drive is not None
    cycles, ratio = float(drive.parameters["Kangle"]), float(drive.ratio)
    begun = bench.standing(made, (Scalar("joint.el.drive.Ka"),))
    angle = ratio * begun.predicted[0].values[:, made.channels.index("az")]
    line = np.zeros_like(made.trials[0].measured)
    line[:, made.channels.index("Tz")] = 3.0 * (np.sin(5.0 * angle) + np.sin(cycles * angle))
    found = proposals(line, made)
    assert {5.0, cycles} <= set(found["kinematic_order.az"])
    # What changes as the output turns, too, has lines between whole ones.
    of_output = found["joint_order.az"]
    assert of_output and {order / ratio for order in of_output} <= set(found["kinematic_order.az"])
    assert found["order.az"] == found["ripple_order.az"] == found["kinematic_order.az"]
    assert found["microstep_order.az"] == (1.0,)
    assert "order.el" not in found  # it turns its motor by less than two turns


def test_the_period_of_a_sawtooth_of_a_disc_is_found_by_folding(made: Experiment) -> None:
    """It has no line of its own in so short a range, but folds into one period, a whole part of a turn."""
    el = made.channels.index("el")
    angle = made.trials[0].measured[:, el]
    turns = np.ptp(angle[made.trials[0].valid]) / (2.0 * np.pi)
    order = np.ceil(3.0 / turns)
    line = np.zeros_like(made.trials[0].measured)
    line[:, el] = 2e-4 * ((order * angle / (2.0 * np.pi) + 0.3) % 1.0 - 0.5)
    periods = proposals(line, made)["profile_period.el"]
    assert {type(one) for one in periods} == {float}  # records hold no numbers of numpy
    found = 2.0 * np.pi / np.array(periods)
    assert np.min(np.abs(found - order)) < 0.1 / turns
    np.testing.assert_allclose(found, np.rint(found), rtol=1e-9)
    assert (found * turns >= 2.0).all()  # two periods at least


@pytest.mark.parametrize("stream", ["wrench", "encoder"])
def test_the_time_at_which_a_clock_jumps_is_each_trajectory_s_own(stream: str) -> None:
    made = bench.experiment(bench.rig(), ("fit", "fit", "held-out"), 1, seconds=60.0)
    apart = tuple(replace(one, trajectory=min(k, 1)) for k, one in enumerate(made.trials))
    made = replace(made, trials=apart)
    begun = bench.standing(made, (Scalar("joint.el.drive.Ka"),))
    channels = slice(0, 6) if stream == "wrench" else slice(made.loads, None)
    for trial, when in ((0, 23.7), (1, 41.2)):
        measured = made.trials[trial].measured
        late = np.arange(len(measured)) * made.dt > when
        shift = np.zeros_like(measured)
        shift[:, channels] = -0.3 * (np.gradient(measured, made.dt, axis=0) * late[:, None])[:, channels]
        if stream == "wrench":  # whose zeros drift, too
            shift[:, channels] += np.linspace(0.0, 0.3, len(measured))[:, None]
        trials = list(made.trials)
        trials[trial] = replace(trials[trial], measured=measured + shift)
        made = replace(made, trials=tuple(trials))
    assert jump(made, begun.predicted, 0, stream) == pytest.approx(23.7, abs=0.5)
    assert jump(made, begun.predicted, 1, stream) == pytest.approx(41.2, abs=0.5)


def test_a_clock_that_jumps_while_a_joint_turns_at_one_rate_is_a_step_of_its_angle() -> None:
    rng = np.random.default_rng(8)
    shown = 0.01 * np.arange(2000.0)[:, None]
    error = -0.05 * (np.arange(2000) > 1200)[:, None] + 1e-3 * rng.standard_normal((2000, 1))
    places = np.arange(50.0, 1950.0, 10.0)
    gain = _gain(error, np.gradient(shown, axis=0), list(_telling(error, np.ones((2000, 1), dtype=np.bool_))), places)
    assert places[np.argmax(gain)] == pytest.approx(1200.0, abs=10.0)


@pytest.mark.parametrize("there", [True, False])
def test_no_jump_is_seen_where_nothing_is_left_or_nothing_is_there(there: bool) -> None:
    shown = np.sin(0.01 * np.arange(500.0))[:, None]
    error = np.zeros((500, 1))
    telling = list(_telling(error, np.full((500, 1), there)))
    gain = _gain(error, np.gradient(shown, axis=0), telling, np.arange(50.0, 450.0))
    np.testing.assert_array_equal(gain, 0.0)
