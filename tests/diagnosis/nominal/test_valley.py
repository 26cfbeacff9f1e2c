"""Steps along a valley that is narrow and bent, Rosenbrock's: the first step of Gauss and Newton overshoots."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from kbs_process.diagnosis.nominal import search as module
from kbs_process.diagnosis.nominal.costs import Found, Ground
from kbs_process.diagnosis.nominal.search import Search
from kbs_process.estimation.fit import Parameters
from kbs_process.identification.polar import Polar
from kbs_process.signals.records import Array

STEEP, LONG = 1e5, 1e2


class Valley(Search):
    """Residuals 1e5 (y - x^2) and 1e2 (1 - x) of numbers x and y of which next to nothing is known."""

    def __init__(self) -> None:
        far = np.full(2, np.inf)
        self.parameters = Parameters(("x", "y"), np.zeros(2), np.full(2, 1e3), -far, far)
        self.precision, self.ridge = self.parameters.sigma**-2.0, np.zeros(2)
        self.polar, self.drives = Polar.of((), self.parameters), [0]
        self.experiment: Any = SimpleNamespace(fit=(0,))
        self.metric: Any = (SimpleNamespace(rows=10),)

    def predict(self, thetas: Any, drives: Any) -> Any:
        """The numbers themselves."""
        return [{0: theta} for theta in thetas]

    def residual(self, k: int, predicted: Any) -> Array:
        x, y = predicted[0]
        return np.array([STEEP * (y - x * x), LONG * (1.0 - x)])

    def at_start(self) -> Found:
        theta = np.array([-1.0, 1.0])
        return Found(theta, {0: theta}, {})  # type: ignore[dict-item]

    def moved(self, found: Found) -> Found:
        J = np.array([[2.0 * STEEP * found.theta[0], -STEEP], [LONG, 0.0]])
        step = self.step(found, Ground(self, found.theta, {0: J}, 1.0))
        return Found(step.theta, step.predicted, {})


@pytest.mark.parametrize(("corrections", "left"), [(0, 0.99), (module._CHORDS, 1e-3)])
def test_corrected_steps_get_along_a_bent_valley(
    monkeypatch: pytest.MonkeyPatch, corrections: int, left: float
) -> None:
    monkeypatch.setattr(module, "_CHORDS", corrections)
    valley = Valley()
    found = valley.at_start()
    begun = valley.height(found)
    for _ in range(3):
        found = valley.moved(found)
    share = valley.height(found) / begun
    assert share < left if corrections else share > left
