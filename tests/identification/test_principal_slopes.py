"""Slopes where a plant jumps: of two numbers known by their difference, the sum gets no information from jumps."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from kbs_process.estimation.fit import triangle
from kbs_process.identification.objective import Objective
from kbs_process.identification.output_error import Experiment, Spectra
from kbs_process.identification.screening import Task

SUM = 0.3  # by which the residual moves for a unit of the sum, and
DIFFERENCE = 60.0  # of the difference
RNG = np.random.default_rng(7)
DIRECTIONS = np.linalg.qr(RNG.standard_normal((400, 2)))[0]
EVENTS = RNG.standard_normal((400, 2000)) * (0.4 / 20.0)  # each jumps by 0.4
AT = RNG.uniform(-2.0, 2.0, 2000)  # of the difference


def residual(values: np.ndarray) -> np.ndarray:
    total, apart = values[0] + values[1], values[0] - values[1]
    smooth = DIRECTIONS @ np.array([SUM * total, DIFFERENCE * apart])
    return smooth + EVENTS @ (np.sign(apart - AT) / 2.0)


def evaluate(tasks: Sequence[Task]) -> list[np.ndarray]:
    return [residual(values) for _, values, _ in tasks]


def length_of_sum(J: np.ndarray) -> float:
    return float(np.linalg.norm(J @ np.array([0.5, 0.5])))


def test_jumps_make_no_information_of_the_sum() -> None:
    free = tuple(SimpleNamespace(name=name) for name in ("a", "b"))
    toy = cast(Experiment, SimpleNamespace(free=free, recordings=("only",), rig=SimpleNamespace(joints=()), effects=()))
    noise = cast(Spectra, ())
    slopes = Objective(toy, [noise], evaluate, np.array([0.05, 0.03]), 2, central=True)
    theta, scale = np.array([0.3, 0.2]), np.ones(2)
    one_by_one = slopes.jacobian(theta)
    J = one_by_one
    for _ in range(2):
        J = slopes.along_principal(theta, triangle(J), scale)
    assert length_of_sum(one_by_one) > 3.0 * SUM
    assert length_of_sum(J) == pytest.approx(SUM, rel=0.5)
    apart = np.array([0.5, -0.5])
    np.testing.assert_allclose(np.linalg.norm(J @ apart), np.linalg.norm(one_by_one @ apart), rtol=0.2)
