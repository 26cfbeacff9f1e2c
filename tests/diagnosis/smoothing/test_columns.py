"""Columns that are zero in most rows give what whole ones give."""

from __future__ import annotations

import numpy as np
import pytest

from kbs_process.diagnosis.smoothing.columns import Columns, within
from kbs_process.diagnosis.smoothing.fit import Banded

N, ROWS = 23, 6


def _whole(count: int, seed: int) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(N, ROWS, count))
    values[:, rng.random((ROWS, count)) < 0.6] = 0.0
    values[:, :, 0] = rng.normal(size=(N, ROWS))  # one that acts on all
    return values


def test_products_are_those_of_whole_columns() -> None:
    one, other = _whole(5, 1), _whole(7, 2)
    root = np.random.default_rng(3).random((N, ROWS))
    found = Columns.of_dense(one).weighed(root).products(Columns.of_dense(other))
    assert found == pytest.approx(np.einsum("nri,nr,nrj->ij", one, root, other))
    by = np.arange(5.0)
    assert Columns.of_dense(one).times(by, ROWS) == pytest.approx(one @ by)
    assert np.array_equal(Columns.of_dense(one).dense(ROWS), one)


def test_columns_beside_others_keep_their_places() -> None:
    one, other = _whole(3, 4), _whole(4, 5)
    both = Columns.beside([Columns.of_dense(one), Columns.of_dense(other)])
    assert np.array_equal(both.dense(ROWS), np.concatenate([one, other], axis=2))
    places = np.array([6, 0, 4, 2, 5, 1, 3])
    moved = both.placed(places, 8).dense(ROWS)
    assert np.array_equal(moved[:, :, places], both.dense(ROWS))
    assert not moved[:, :, 7].any()
    few, many = both.divided(3)
    assert sorted([*few, *many]) == list(range(7))
    assert all((both.dense(ROWS)[:, :, k] != 0.0).any(axis=0).sum() > 3 for k in many)
    assert np.array_equal(both.chosen(many).dense(ROWS), both.dense(ROWS)[:, :, many])


def test_products_between_columns_of_others_are_left_out() -> None:
    whole, owner = _whole(6, 6), np.array([0, 0, 1, 2, 2, 2])
    every = np.einsum("nri,nrj->ij", whole, whole)
    expected = np.where(owner[:, None] == owner, every, 0.0)
    assert Columns.of_dense(whole).squares(owner) == pytest.approx(expected)
    assert within(whole.reshape(-1, 6), owner) == pytest.approx(expected)


def test_what_the_motion_takes_up_is_the_projection_on_all_that_it_does() -> None:
    rng = np.random.default_rng(7)
    by_motion, bases = rng.normal(size=(N, ROWS, 2, 3)), rng.normal(size=(3, 5))
    banded = Banded.of(by_motion, bases, np.ones((N, ROWS)))
    shown = np.zeros((N, ROWS, N + 4, 2))  # by coefficients of two freedoms
    for i in range(N):
        shown[i, :, i : i + 5] = np.einsum("rfo,ol->rlf", by_motion[i], bases)
    basis = shown.reshape(N * ROWS, -1)
    columns = _whole(5, 8)
    flat = columns.reshape(N * ROWS, -1)
    expected = basis @ np.linalg.lstsq(basis, flat, rcond=None)[0]
    against = banded.against(Columns.of_dense(columns))
    found = np.stack([banded.shown(against[:, :, k]) for k in range(5)], axis=2)
    assert found.reshape(N * ROWS, -1) == pytest.approx(expected, abs=1e-5)
    taken = against.reshape(-1, 5)
    assert taken.T @ taken == pytest.approx(flat.T @ expected, abs=1e-4)
