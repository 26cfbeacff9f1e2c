"""Slopes along a valley, of a plant that is linear and whose columns were taken with errors."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from kbs_process.diagnosis.nominal.tangents import along_valleys
from kbs_process.estimation.fit import Parameters
from kbs_process.identification.polar import Polar
from kbs_process.signals.records import Array

FAR = np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0)  # along it the first two numbers make up for each other


@dataclass(frozen=True)
class Shown:
    values: Array  # (n, 1)


@dataclass(frozen=True)
class Slope:
    base: Shown
    columns: Array  # (p, n, 1)


def plant() -> Array:
    """(n, 3) columns: the first two differ by a thousandth of their length, the third is its own."""
    rng = np.random.default_rng(5)
    one, other, third = rng.standard_normal((3, 200)) * 100.0
    return np.column_stack([one, -one + 1e-3 * other, third])


def search(columns: Array, broken: bool = False, left: float = 0.0) -> Any:
    """What `along_valleys` asks of a search: one trial, `left` times the noise's power in it, little known before."""
    wide = np.full(3, np.inf)
    parameters = Parameters(("a", "b", "c"), np.zeros(3), np.full(3, 1e3), -wide, wide)
    polar = Polar.of((), parameters)

    def predict(points: list[Array], drives: Any) -> list[dict[int, Shown]]:
        return [{0: Shown((columns @ point)[:, None] * (np.nan if broken else 1.0))} for point in points]

    return SimpleNamespace(
        stated=np.ones(3, dtype=np.bool_), parameters=parameters, polar=polar,
        precision=parameters.sigma**-2.0, ridge=np.zeros(3), spread=np.ones(3),
        inside=[0, 1, 2], references=[0], predict=predict,
        experiment=SimpleNamespace(fit=(0,), trials=[SimpleNamespace(drive=0)]),
        metric=(SimpleNamespace(rows=200),),
        residual=lambda k, shown: np.sqrt(left) - shown[0].values[:, 0],
        jacobians=lambda gradients: {0: gradients[0].columns[:, :, 0].T},
        room=lambda theta: (-wide, wide), clipped=lambda theta: theta,
    )  # fmt: skip


def taken(columns: Array) -> dict[int, Any]:
    """Slopes at zero, each off by some thousandths of it."""
    off = columns * (1.0 + 3e-3 * np.random.default_rng(6).standard_normal(columns.shape))
    return {0: Slope(Shown(np.zeros((200, 1))), off.T[:, :, None])}


def missed(columns: Array, slopes: dict[int, Any], direction: Array) -> float:
    """Error of a slope along a direction, over its length."""
    true = columns @ direction
    return float(np.linalg.norm(slopes[0].columns[:, :, 0].T @ direction - true) / np.linalg.norm(true))


def test_slopes_along_a_valley_are_what_the_plant_does_there() -> None:
    columns = plant()
    before = taken(columns)
    after = along_valleys(search(columns), np.zeros(3), before)
    assert missed(columns, before, FAR) > 1.0
    assert missed(columns, after, FAR) < 0.1
    third = np.array([0.0, 0.0, 1.0])
    assert missed(columns, after, third) < 2.0 * missed(columns, before, third) < 0.02


def test_a_plant_that_cannot_run_there_leaves_slopes_as_they_are() -> None:
    columns = plant()
    before = taken(columns)
    assert along_valleys(search(columns, broken=True), np.zeros(3), before) is before


def test_where_much_is_left_slopes_stay_as_they_are() -> None:
    columns = plant()
    before = taken(columns)
    assert along_valleys(search(columns, left=3.0), np.zeros(3), before) is before
    assert along_valleys(search(columns, left=1.0), np.zeros(3), before) is not before
