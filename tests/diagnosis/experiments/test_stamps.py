"""Clocks whose stamps are late: exactly what they read, and back, where vibration is too fast for first order."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from diagnosis.selection.test_rounds import candidate, standing
from kbs_process.diagnosis.acceptance.finding import find_of
from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.floor import declared
from kbs_process.diagnosis.experiments.jumps import jump
from kbs_process.diagnosis.experiments.stamps import late_by, set_right, slope
from kbs_process.diagnosis.nominal.joint import Standing
from kbs_process.diagnosis.proposing.clocks import timed
from kbs_process.diagnosis.proposing.view import View
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.diagnosis.screening.screen import Bench, Catalogued, screen
from kbs_process.diagnosis.selection import each_recording, mistimed, rounds
from kbs_process.diagnosis.selection.each_recording import jump_gain, taken_off, taken_off_again
from kbs_process.diagnosis.selection.effort import Effort
from kbs_process.signals.records import Array

pytestmark = pytest.mark.validation

DT = 0.05
T = np.arange(1200) * DT
INSIDE = slice(60, -60)
LATE = 0.04 * np.sin(2.0 * np.pi * T / 25.0)


def vibration(t: Array) -> Array:
    """(n, 2) of a transducer's resonance, on a slow load and on none."""
    fast = np.sin(2.0 * np.pi * 6.3 * t)
    return np.stack([5.0 * np.sin(0.3 * t) + fast, fast], axis=1)


def test_what_is_late_reads_what_was_at_the_resonance_too() -> None:
    read = vibration(T) + late_by(vibration(T), DT, LATE)
    np.testing.assert_allclose(read[INSIDE], vibration(T - LATE)[INSIDE], atol=3e-3)
    first_order = vibration(T) - LATE[:, None] * slope(vibration(T), DT)
    assert np.abs(first_order - vibration(T - LATE))[INSIDE].max() > 0.5


def test_slopes_are_right_up_to_the_end_of_the_band() -> None:
    fast = 2.0 * np.pi * 6.3 * np.cos(2.0 * np.pi * 6.3 * T)
    np.testing.assert_allclose(slope(vibration(T), DT)[INSIDE, 1], fast[INSIDE], atol=5e-3 * np.abs(fast).max())


@pytest.mark.parametrize("late", [LATE, np.where(T > 31.0, -0.08, 0.0), np.full(len(T), 0.06)])
def test_a_recording_is_set_right(late: Array) -> None:
    read = vibration(T) + late_by(vibration(T), DT, late)
    valid = np.ones(len(T), dtype=np.bool_)
    valid[300:310] = False
    right, there = set_right(read * valid[:, None], valid, DT, late)
    assert not there[301:308].any() and there[320:].mean() > 0.96
    # Where the clock jumps some of what was due has two stamps, or none.
    jump = np.abs(T - 31.0) < 0.8 if np.ptp(np.diff(late)) > 0.05 else np.zeros(len(T), dtype=np.bool_)
    good = there & ~jump
    good[:60] = good[-60:] = good[290:320] = False
    np.testing.assert_allclose(right[good], vibration(T)[good], atol=0.02)


def test_a_clock_is_taken_off_exactly() -> None:
    """It wanders by more than a radian of what rings: to first order most of that is left."""
    made = bench.experiment(bench.rig(), ("calibration", "fit", "held-out"), 9, seconds=40.0)
    t = np.arange(800) * DT
    ringing = np.sin(2.0 * np.pi * 6.3 * t)[:, None] * np.r_[np.full(6, 0.2), 0.0, 0.0]
    late = np.sin(2.0 * np.pi * t / 25.0)
    trials = []
    for trial, size in zip(made.trials, (0.02, 0.03, 0.03), strict=True):
        whole = trial.measured + ringing
        whole[:, :6] += late_by(whole[:, :6], DT, size * late)
        trials.append(replace(trial, measured=whole * trial.valid[:, None]))
    # What rings is predicted: the clock alone is wrong.
    here = standing(replace(made, trials=tuple(trials)))
    known = here.known
    rung = {0: replace(here.predicted[0], values=here.predicted[0].values + ringing)}
    residual = tuple(m(t.measured - rung[0].values) for m, t in zip(known.metric, known.experiment.trials, strict=True))
    known = replace(known, shown=rung, residual=residual)
    here = Standing(known, rung, {})
    scene = Scene.of(known.experiment, here.hypothesis, rung)
    suspect = Catalogued(candidate("clock_wander", "wrench", wander_period=25.0), scene)
    tried = Bench.of(known, scene)
    screening = screen(tried, [suspect])
    told = taken_off(screening.candidates[0], View(here, tried, scene, (suspect,), screening))
    assert told.gate.passed, told.gate.reasons
    sizes = told.found.score.amplitude.reshape(2, 2)
    np.testing.assert_allclose(sizes, [[0.02, 0.0], [0.03, 0.0]], atol=3e-4)
    # A find is told as the first recording has it that is no calibration.
    sin, cos, period = find_of([told], np.ones(1), here, None).estimates
    assert (sin.value, cos.value, period.value) == (*sizes[1], 25.0)
    unit, rows = known.metric[0](tried.signatures([suspect], 0)), np.asarray(known.rows)
    first_order = known.residual[0] - unit @ screening.candidates[0].score.amplitude[:2]
    assert first_order @ first_order > 3.0 * told.standing.known.chi2[0]
    assert all(told.standing.known.chi2 < 1.5 * rows)
    # What the first correction has left undone is taken off beside numbers as they are then.
    again = taken_off_again(told)
    assert again.standing.known.cost <= told.standing.known.cost
    np.testing.assert_allclose(again.found.score.amplitude.reshape(2, 2), sizes, atol=1e-4)


@pytest.mark.parametrize("late", [0.06, -0.11])
def test_a_clock_that_is_late_by_half_a_period_is_found_at_its_size(late: float) -> None:
    made = bench.experiment(bench.rig(), ("fit", "fit"), 9, seconds=40.0)
    t = DT * np.arange(800)
    ringing = np.sin(2.0 * np.pi * (4.5 + 0.03 * t) * t)[:, None] * np.r_[np.full(6, 0.2), 0.0, 0.0]
    trials = []
    for trial in made.trials:
        whole = trial.measured + ringing
        whole[:, :6] += late_by(whole[:, :6], DT, np.full(800, late))
        trials.append(replace(trial, measured=whole * trial.valid[:, None]))
    here = standing(replace(made, trials=tuple(trials)))
    known = here.known
    rung = {0: replace(here.predicted[0], values=here.predicted[0].values + ringing)}
    residual = tuple(m(t.measured - rung[0].values) for m, t in zip(known.metric, known.experiment.trials, strict=True))
    known = replace(known, shown=rung, residual=residual)
    scene = Scene.of(known.experiment, here.hypothesis, rung)
    suspect = Catalogued(candidate("clock_offset", "wrench"), scene)
    tried = Bench.of(known, scene)
    linear = screen(tried, [suspect]).candidates[0]
    assert abs(linear.score.amplitude[0]) < 0.5 * abs(late)
    found = timed(tried, linear, [suspect])
    assert found.score.amplitude == pytest.approx([late], abs=5e-4)
    assert found.score.gain > 1.3 * linear.score.gain
    # Its columns are exact at that size.
    assert isinstance(found.suspect, Catalogued)
    column = tried.signatures([found.suspect], 0)[:, :6, 0] * found.score.amplitude
    np.testing.assert_allclose(
        column[60:-60], late_by(rung[0].values[:, :6], DT, np.full(800, late))[60:-60], atol=0.02
    )


def ringing_of(t: Array) -> Array:
    """(n, 8) of the transducer, ever faster; the encoders do not ring."""
    return np.sin(2.0 * np.pi * (2.0 + 0.04 * t) * t)[:, None] * np.r_[np.full(6, 0.2), 0.0, 0.0]


def jumped_at(place: float, lost: float) -> tuple[Experiment, View]:
    """What rings, without error, and the view of jumps of the wrench's clock, which loses `lost` s at a `place`, s."""
    made = bench.experiment(bench.rig(), ("fit", "fit", "held-out"), 9, seconds=40.0)
    t = DT * np.arange(800)
    ringing = ringing_of(t)
    late = np.where(t > place, -lost, 0.0)
    trials = []
    for trial in made.trials:
        whole = trial.measured + ringing
        whole[:, :6] += late_by(whole[:, :6], DT, late)
        trials.append(replace(trial, measured=whole * trial.valid[:, None]))
    here = standing(replace(made, trials=tuple(trials)))
    rung = {0: replace(here.predicted[0], values=here.predicted[0].values + ringing)}
    residual = tuple(
        m(t.measured - rung[0].values) for m, t in zip(here.known.metric, here.known.experiment.trials, strict=True)
    )
    known = replace(here.known, shown=rung, residual=residual)
    here = Standing(known, rung, {})
    scene = Scene.of(known.experiment, here.hypothesis, rung)
    suspect = Catalogued(candidate("clock_drops", "wrench"), scene)
    tried = Bench.of(known, scene)
    return made, View(here, tried, scene, (suspect,), screen(tried, [suspect]))


@pytest.mark.parametrize("lost", [0.09, 0.46])
def test_a_clock_that_jumps_by_periods_is_taken_off_at_its_place_and_size(lost: float) -> None:
    """To first order such a jump is none: it is tried at many sizes."""
    t = DT * np.arange(800)
    ringing = ringing_of(t)
    made, view = jumped_at(17.3, lost)
    here, known = view.standing, view.standing.known
    rung = known.shown
    told = taken_off(view.screening.candidates[0], view)
    assert known.gross
    assert told.found.score.amplitude == pytest.approx([lost, lost], abs=2e-3)
    when = jump(known.experiment, rung, 0, "wrench")
    assert when == pytest.approx(17.3, abs=0.3)
    assert all(told.standing.known.chi2 < 0.2 * known.chi2)
    # What is read about the jump says nothing: there are as many stamps as one may have had.
    for one in told.standing.known.experiment.trials:
        lacks = one.measured[:, :6] - rung[0].values[:, :6]
        assert np.abs(np.diff(lacks[(t > 16.6) & (t < 18.0)], n=2, axis=0)).max() < 1e-9
    # It is told before any law is simulated, and recordings are stamped anew by it for numbers that it has not pulled.
    floor, simulate = declared(known.experiment), Effort(bench.serial(known.experiment), known)
    view = View.of(here, lambda one: isinstance(one, Catalogued) and one.of_clock, linear=False)
    jumped = min(rounds._jumped(view, floor, simulate), key=lambda one: one.standing.known.cost)
    assert jumped.found.suspect.family == ("clock_drops", "wrench")
    anew = mistimed._stamped_anew(known)
    assert anew is not None
    for trial, right in zip(anew.trials, made.trials, strict=True):
        apart = (trial.measured - right.measured - ringing)[(t > 18.5) & (t < 39.0), :6]
        assert np.quantile(np.abs(apart), 0.95) < 0.1 * np.std(ringing[:, 0])


@pytest.mark.parametrize(
    ("unevenly", "most", "passes"), [((), True, True), ((2,), True, True), ((1, 2), True, False), ((2,), False, False)]
)
def test_half_of_the_recordings_show_a_jump_all_through(
    monkeypatch: pytest.MonkeyPatch, unevenly: tuple[int, ...], most: bool, passes: bool
) -> None:
    """The others may show it in one part, the last turn's, where it does nearly all of much."""
    _, view = jumped_at(17.3, 0.46)
    even = each_recording._even_gain
    monkeypatch.setattr(
        each_recording, "_even_gain", lambda one, k, known: 0.0 if k in unevenly else even(one, k, known)
    )
    if not most:
        monkeypatch.setattr(each_recording, "jump_gain", lambda *_: 0.5 * view.standing.known.excess)
    verdict = taken_off(view.screening.candidates[0], view).gate
    assert verdict.passed == passes
    assert [reason for reason in verdict.reasons if "all through" in reason] == (
        [] if passes else [", ".join(f"r{k}" for k in unevenly) + " do not show it, all through"]
    )


def test_what_is_left_out_about_a_jump_is_none_of_its_doing() -> None:
    """All recordings have a knock at one time: a jump there would hide it, and nobody would look for what it is."""
    made = bench.experiment(bench.rig(), ("fit", "fit", "held-out"), 9, seconds=40.0)
    t = DT * np.arange(800)
    ringing = ringing_of(t)
    knock = 2.0 * np.exp(-(((t - 17.0) / 0.15) ** 2))[:, None] * np.r_[np.full(6, 1.0), 0.0, 0.0]
    trials = []
    for trial in made.trials:
        whole = trial.measured + ringing + knock
        whole[:, :6] += late_by(whole[:, :6], DT, 4e-4 * (t - 10.0))
        trials.append(replace(trial, measured=whole * trial.valid[:, None]))
    here = standing(replace(made, trials=tuple(trials)))
    rung = {0: replace(here.predicted[0], values=here.predicted[0].values + ringing)}
    residual = tuple(
        m(trial.measured - rung[0].values)
        for m, trial in zip(here.known.metric, here.known.experiment.trials, strict=True)
    )
    known = replace(here.known, shown=rung, residual=residual)
    assert known.gross
    here = Standing(known, rung, {})
    view = View.of(here, lambda one: isinstance(one, Catalogued) and one.jumps, linear=False)
    found = next(one for one in view.screening.candidates if one.suspect.family[1] == "wrench")
    after = taken_off(found, view).standing.known
    assert after.excess < 0.5 * known.excess
    assert jump_gain(found, known, after) < 0.25 * known.excess
    floor, simulate = declared(known.experiment), Effort(bench.serial(known.experiment), known)
    assert rounds._jumped(view, floor, simulate) == []


def test_what_all_recordings_share_of_a_clock_is_no_jump() -> None:
    made = bench.experiment(bench.rig(), ("fit", "fit", "held-out"), 9, seconds=40.0)
    t = DT * np.arange(800)
    ringing = ringing_of(t)
    trials = []
    for trial in made.trials:
        whole = trial.measured + ringing
        whole[:, :6] += late_by(whole[:, :6], DT, 2e-3 * t)
        trials.append(replace(trial, measured=whole * trial.valid[:, None]))
    here = standing(replace(made, trials=tuple(trials)))
    rung = {0: replace(here.predicted[0], values=here.predicted[0].values + ringing)}
    residual = tuple(
        m(trial.measured - rung[0].values)
        for m, trial in zip(here.known.metric, here.known.experiment.trials, strict=True)
    )
    known = replace(here.known, shown=rung, residual=residual)
    assert known.gross
    view = View.of(Standing(known, rung, {}), lambda one: isinstance(one, Catalogued) and one.of_clock, linear=False)
    simulate = Effort(bench.serial(known.experiment), known)
    assert rounds._jumped(view, declared(known.experiment), simulate) == []
    anew = mistimed._stamped_anew(known)
    assert anew is not None
    late = (anew.trials[2].measured - made.trials[2].measured - ringing)[(t > 1.0) & (t < 38.0), :6]
    assert np.quantile(np.abs(late), 0.95) < 0.1 * np.std(ringing[:, 0])
