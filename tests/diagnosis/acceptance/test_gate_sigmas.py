"""By how much a law is there: its amplitudes off zero, its shapes as they are and all that is known free."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis import bench
from kbs_process.diagnosis.acceptance.evenness import evenly, parts
from kbs_process.diagnosis.acceptance.gate import _beside, _evenly, _sigmas
from kbs_process.identification.output_error import Scalar

pytestmark = pytest.mark.slow


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
    size = np.sqrt(np.diag(np.linalg.inv(H)))
    assert np.abs(found[held] / np.outer(size[held], size)).max() < 1e-6  # what is held does not move
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


def test_what_a_law_does_is_less_what_all_other_numbers_take_up_of_it() -> None:
    """J C_i C_ii^-1 a is the law's own columns less their projection on the others', within these ones' priors."""
    made = bench.experiment(bench.rig(), ("fit", "fit"), 1)
    free = tuple(Scalar(f"joint.el.drive.{name}") for name in ("Ka", "fsv", "Tmax"))
    known = bench.standing(made, free).known
    J = {k: known.jacobian(k) for k in made.fit}
    precision = np.diag(np.array([1.0, 0.0, 1.0]) / known.parameters.sigma**2)
    H = sum((one.T @ one for one in J.values()), precision)
    others, law, a = [0, 2], 1, 0.3 * known.value[1]
    known = replace(known, covariance=np.linalg.inv(H), value=np.array([1.0, a, 1.0]))
    taken = np.linalg.solve(H[np.ix_(others, others)], H[others, law])
    expected = evenly(
        made,
        {
            k: parts(made, k, known.metric[k], a * (one[:, law] - one[:, others] @ taken), known.residual[k])
            for k, one in J.items()
        },
    )
    assert _evenly(known, known.covariance, np.array([law])) == pytest.approx(expected, rel=1e-6)
