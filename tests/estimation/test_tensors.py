"""Inertia tensors in fits stay those of bodies."""

from __future__ import annotations

import numpy as np
import pytest

from kbs_process.estimation.fit import Parameters, fit_map
from kbs_process.estimation.tensors import Tensors
from kbs_process.signals.records import Array

NAMES = ("body.base.mass", *(f"body.head.inertia[{i}]" for i in range(6)))
START = np.array([2.0, 3.0, 4.0, 0.5, 0.0, 0.2])


def least(tensor: Array) -> float:
    xx, yy, zz, xy, xz, yz = tensor
    return float(np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])[0])


def all_free() -> Tensors:
    return Tensors.among(NAMES, {"body.head.inertia": START, "body.base.inertia": START})


def test_a_body_keeps_its_tensor_to_the_bit() -> None:
    theta = np.array([7.0, *START])
    assert np.array_equal(all_free().bodily(theta), theta)
    assert not all_free().at_edge(theta)


def test_products_shrink_together_and_moments_stay() -> None:
    theta = np.array([7.0, 1.0, 1.0, 1.0, 0.9, 0.9, -0.9])
    given = all_free().bodily(theta)
    assert given[0] == 7.0
    assert np.array_equal(given[1:4], theta[1:4])
    assert given[4:] / theta[4:] == pytest.approx(np.full(3, 0.5 / 0.9))  # by hand: eigenvalue 1 - 2 p is zero
    assert least(given[1:]) == pytest.approx(0.0, abs=1e-9)
    assert all_free().at_edge(given) == {1, 2, 3, 4, 5, 6}


def test_products_that_are_exact_hold_the_moments() -> None:
    """The moment about z may fall no lower than xz^2 / xx = 2 lets it."""
    start = np.array([2.0, 9.0, 4.0, 0.0, 2.0, 0.0])
    own = Tensors.among(["body.arm.inertia[2]"], {"body.arm.inertia": start})
    assert own.bodily(np.array([0.1])) == pytest.approx([2.0], rel=1e-6)
    assert own.bodily(np.array([2.5])) == pytest.approx([2.5])


def test_those_that_are_chosen_take_the_others_at_the_start() -> None:
    rest = all_free().chosen([0, 4])  # the mass, and the product xy
    assert rest.bodily(np.array([1.0, 0.5])) == pytest.approx([1.0, 0.5])
    limit = np.sqrt(2.0 * (3.0 - 0.2**2 / 4.0))  # Schur's complement of zz in START
    assert rest.bodily(np.array([1.0, 50.0])) == pytest.approx([1.0, limit], rel=1e-6)


def test_a_fit_ends_at_the_inertia_of_a_body_and_says_so() -> None:
    """Readings that ask for products beyond the moments, and for a negative moment."""
    wanted = np.array([1.0, 1.0, -0.3, 1.4, 0.0, 0.0])
    names = NAMES[1:]
    lower = np.array([0.0] * 3 + [-np.inf] * 3)
    parameters = Parameters(
        names, START, np.full(6, 20.0), lower, tensors=Tensors.among(names, {"body.head.inertia": START})
    )
    fit = fit_map(lambda theta: np.repeat(100.0 * (wanted - theta), 4), parameters)
    assert least(fit.value) >= -1e-9
    assert fit.value[2] == 0.0
    assert not fit.ok
    assert "body.head.inertia[3]" in next(check.detail for check in fit.checks if check.name == "within bounds")
