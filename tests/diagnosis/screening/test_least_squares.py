"""Least squares of signatures behind known parameters: amplitudes, absorption, false alarms, tails."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from kbs_process.diagnosis.screening.gls import Background, Sums, absorbing, per_trial, score
from kbs_process.estimation.tails import log_tail
from kbs_process.signals.records import Array

ROWS, KNOWN = 400, 6


def drawn(rng: np.random.Generator, trials: int = 3) -> tuple[dict[int, Array], Array]:
    J = {k: rng.standard_normal((ROWS, KNOWN)) for k in range(trials)}
    return J, np.full(KNOWN, 1.0)


def test_amplitudes_are_those_of_one_large_least_squares() -> None:
    rng = np.random.default_rng(1)
    J, precision = drawn(rng)
    S = {k: rng.standard_normal((ROWS, 2)) + 0.5 * J[k][:, :2] for k in J}
    z = {k: rng.standard_normal(ROWS) + S[k] @ [0.3, -0.2] for k in J}
    found = score(Background.of(z, J, precision), Sums.over(Background.of(z, J, precision), S))
    A = np.vstack([*[np.hstack([S[k], J[k]]) for k in J], np.hstack([np.zeros((KNOWN, 2)), np.eye(KNOWN)])])
    y = np.concatenate([*z.values(), np.zeros(KNOWN)])
    whole = np.linalg.lstsq(A, y)[0]
    assert found.amplitude == pytest.approx(whole[:2])
    assert found.covariance == pytest.approx(np.linalg.inv(A.T @ A)[:2, :2])
    without = np.linalg.lstsq(A[:, 2:], y)[0]
    assert found.gain == pytest.approx(np.sum((y - A[:, 2:] @ without) ** 2) - np.sum((y - A @ whole) ** 2))


def test_what_a_known_parameter_does_is_absorbed_and_named() -> None:
    rng = np.random.default_rng(2)
    J, _ = drawn(rng)
    z = {k: J[k][:, 3] + rng.standard_normal(ROWS) for k in J}
    S = {k: J[k][:, 3:4] + 0.03 * rng.standard_normal((ROWS, 1)) for k in J}
    background = Background.of(z, J, np.full(KNOWN, 1e-6))
    sums = Sums.over(background, S)
    found = score(background, sums)
    assert found.kappa > 0.99
    assert absorbing(background, sums, found.whole, tuple("abcdef"))[0] == "d"
    # Held by a narrow prior it takes nothing.
    tight = Background.of(z, J, np.full(KNOWN, 1e9))
    assert score(tight, Sums.over(tight, S)).kappa < 0.01


def test_gain_of_nothing_is_chi_square() -> None:
    rng = np.random.default_rng(3)
    gains = []
    for _ in range(300):
        J, precision = drawn(rng, 2)
        off = rng.standard_normal(KNOWN)
        z = {k: rng.standard_normal(ROWS) + J[k] @ off for k in J}
        background = Background.of(z, J, 1e-6 * precision)
        S = {k: rng.standard_normal((ROWS, 3)) + J[k][:, :3] for k in J}
        gains.append(score(background, Sums.over(background, S)).gain)
    assert np.mean(gains) == pytest.approx(3.0, abs=4.0 * np.sqrt(6.0 / 300.0))
    assert np.mean(np.array(gains) > chi2.isf(0.1, 3)) == pytest.approx(0.1, abs=0.06)


def test_combinations_that_known_parameters_take_up_gain_nothing() -> None:
    """Two amplitudes, mixed: one does what a known number does, which is far from its prior, the other is its own."""
    rng = np.random.default_rng(9)
    J, _ = drawn(rng)
    mine = {k: rng.standard_normal(ROWS) for k in J}
    z = {k: 5.0 * J[k][:, 3] + 0.5 * mine[k] + rng.standard_normal(ROWS) for k in J}
    background = Background.of(z, J, np.full(KNOWN, 0.1), np.full(KNOWN, -50.0))
    both = {k: np.stack([J[k][:, 3] + mine[k], J[k][:, 3] - mine[k]], axis=1) for k in J}
    alone = {k: mine[k][:, None] for k in J}
    found = score(background, Sums.over(background, both))
    own = score(background, Sums.over(background, alone))
    assert (found.rank, found.whole_rank) == (1, 2)
    assert found.gain == pytest.approx(own.gain, rel=1e-2) and found.whole_gain > 1.05 * found.gain
    first, second = found.amplitude
    assert first - second == pytest.approx(own.amplitude[0], rel=0.05)
    assert first + second == pytest.approx(0.0, abs=0.05)


def test_known_numbers_that_stand_at_bounds_do_not_do_what_an_effect_does() -> None:
    rng = np.random.default_rng(10)
    J, precision = drawn(rng)
    # Nearly what a known number does, which may go no farther.
    S = {k: J[k][:, 3:4] + 0.3 * rng.standard_normal((ROWS, 1)) for k in J}
    z = {k: 4.0 * S[k][:, 0] + 2.0 * J[k][:, 3] + rng.standard_normal(ROWS) for k in J}
    far, near = np.full(KNOWN, 100.0), np.where(np.arange(KNOWN) == 3, 0.0, 100.0)
    free, wide, bound = (Background.of(z, J, precision, room=room) for room in (None, (-far, far), (-far, near)))
    without, unbarred, held = (score(one, Sums.over(one, S)) for one in (free, wide, bound))
    assert unbarred.gain == without.gain
    assert held.gain > 3.0 * without.gain
    # As by hand: the number that stands at its bound, and would go farther with the effect as well, has no column.
    A = np.vstack([*[np.hstack([S[k], np.delete(J[k], 3, 1)]) for k in J],
                   np.hstack([np.zeros((KNOWN - 1, 1)), np.diag(np.sqrt(np.delete(precision, 3)))])])  # fmt: skip
    y = np.concatenate([*z.values(), np.zeros(KNOWN - 1)])
    joint, alone = (np.linalg.lstsq(part, y)[0] for part in (A, A[:, 1:]))
    assert held.amplitude[0] == pytest.approx(joint[0], rel=1e-6)
    squares = np.sum((y - A[:, 1:] @ alone) ** 2) - np.sum((y - A @ joint) ** 2)
    assert held.gain == pytest.approx(squares, rel=1e-6)


def test_known_numbers_that_would_leave_their_bounds_beside_an_effect_do_not() -> None:
    """Alone the number has nothing to do; an effect that is nearly its own would draw it far out."""
    rng = np.random.default_rng(11)
    J, precision = drawn(rng)
    noise = {k: rng.standard_normal(ROWS) for k in J}
    S = {k: (J[k][:, 3] + 0.3 * noise[k])[:, None] for k in J}
    z = {k: 6.0 * noise[k] for k in J}  # the effect of 20 less 20 of the number
    room = np.full(KNOWN, 1.0)
    weak = 1e-3 * precision
    free, bound = Background.of(z, J, weak), Background.of(z, J, weak, room=(-room, room))
    without, held = (score(one, Sums.over(one, S)) for one in (free, bound))
    assert without.amplitude[0] == pytest.approx(20.0, rel=0.05)
    assert held.gain < 0.3 * without.gain and held.amplitude[0] < 5.0


def test_dependent_amplitudes_count_once() -> None:
    rng = np.random.default_rng(4)
    J, precision = drawn(rng)
    column = {k: rng.standard_normal((ROWS, 1)) for k in J}
    z = {k: 2.0 * column[k][:, 0] + rng.standard_normal(ROWS) for k in J}
    background = Background.of(z, J, precision)
    one = score(background, Sums.over(background, column))
    twice = score(background, Sums.over(background, {k: np.hstack([c, 2.0 * c, 0.0 * c]) for k, c in column.items()}))
    assert (one.rank, twice.rank) == (1, 1)
    assert twice.gain == pytest.approx(one.gain)
    assert twice.amplitude @ [1.0, 2.0, 0.0] == pytest.approx(one.amplitude[0])


def test_an_amplitude_of_its_own_in_each_trial() -> None:
    rng = np.random.default_rng(5)
    J, precision = drawn(rng)
    column = {k: rng.standard_normal((ROWS, 1)) for k in J}
    z = {k: (k - 1.0) * column[k][:, 0] + 0.1 * rng.standard_normal(ROWS) for k in J}
    background = Background.of(z, J, precision)
    assert score(background, per_trial(background, column)).amplitude == pytest.approx([-1.0, 0.0, 1.0], abs=0.05)


def test_repeats_whitened_alike_are_multiplied_once_and_counted_all() -> None:
    rng = np.random.default_rng(6)
    x, slopes = rng.standard_normal((ROWS, 2)), rng.standard_normal((ROWS, KNOWN))
    z = {k: rng.standard_normal(ROWS) for k in range(3)}
    background = Background.of(z, dict.fromkeys(z, slopes), np.ones(KNOWN))
    shared = Sums.over(background, dict.fromkeys(z, x))
    alone = Sums.over(background, {k: x.copy() for k in z})
    assert pytest.approx(alone.SS) == shared.SS
    assert shared.Sz == pytest.approx(alone.Sz)
    assert pytest.approx(alone.SJ) == shared.SJ


def test_tails_go_on_where_floats_end() -> None:
    assert log_tail(3.0, 2) == pytest.approx(-1.5)
    for dof in (1, 4, 40):
        near, far = log_tail(1400.0, dof), log_tail(3000.0, dof)
        slope = (far - near) / 1600.0
        assert -0.501 < slope < -0.48
    assert log_tail(90000.0, 2) == pytest.approx(-45000.0)
