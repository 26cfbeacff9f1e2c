"""By how much a law is there: its amplitudes off zero, its shapes as they are and all that is known free."""

from __future__ import annotations

import numpy as np
import pytest

from kbs_process.diagnosis.gate import _beside, _sigmas


def test_numbers_that_are_held_leave_the_inverse_of_what_is_left_of_the_information() -> None:
    rng = np.random.default_rng(2)
    J = rng.standard_normal((60, 7)) * np.geomspace(1e-3, 1e3, 7)
    H = J.T @ J
    index, held = np.array([5, 1]), np.array([0, 6])
    free = [1, 2, 3, 4, 5]
    expected = np.linalg.inv(H[np.ix_(free, free)])
    places = [free.index(k) for k in index]
    found = _beside(np.linalg.inv(H), held)
    np.testing.assert_allclose(found[np.ix_(index, index)], expected[np.ix_(places, places)], rtol=1e-6)
    none = _beside(np.linalg.inv(H), np.zeros(0, dtype=np.intp))
    np.testing.assert_array_equal(none, np.linalg.inv(H))


@pytest.mark.parametrize("alike", [0.9, 0.999999])
def test_a_force_whose_lever_makes_up_for_it_is_there_all_the_same(alike: float) -> None:
    """An amplitude at 20 sigma for a given lever; the lever shows as nearly the same."""
    H = 400.0 * np.array([[1.0, alike], [alike, 1.0]])
    C, one = np.linalg.inv(H), np.ones(1)
    held = np.array([1])
    assert _sigmas(one, _beside(C, held)[:1, :1]) == pytest.approx(20.0, rel=1e-3)
    alone = _sigmas(one, C[:1, :1])
    assert alone == pytest.approx(20.0 * np.sqrt(1.0 - alike**2), rel=1e-3)
