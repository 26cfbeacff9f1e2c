"""Rigs drawn from what is known of one: every uncertain number of the plant at once, by Latin hypercube."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm, qmc, truncnorm

from kbs_process.plant.effect import Effect, LogNormal, Parameter, Uniform
from kbs_process.rig.model import Quantity, Rig
from kbs_process.signals.records import Array

_UNKNOWN = 0.95  # of a uniform prior's standard deviation: a phase known no better than that is not known
_POSITIVE = ("mass", "ratio", "rotor_inertia")
_NOT_THE_PLANT = ("transducer.", "gravity.", "external.")  # of the test bench


@dataclass(frozen=True, slots=True)
class Uncertain:
    """One number of a rig that is not exactly known."""

    quantity: str  # dotted name
    index: tuple[int, ...]  # within the quantity; () for a scalar
    value: float
    sigma: float
    shape: Parameter | None  # the effect's declaration of it, where it is an effect's

    @property
    def name(self) -> str:
        return f"{self.quantity}[{','.join(map(str, self.index))}]" if self.index else self.quantity

    @property
    def cyclic(self) -> bool:
        """Whether it is a phase: its effect has no order, only a direction."""
        return self.shape is not None and isinstance(self.shape.prior, Uniform)

    def at(self, probability: Array) -> Array:
        """Return its quantiles.

        Phases of which nothing is known are uniform; other drive parameters have the distribution that their effect
        declares, moved to `value` and `sigma`, and cut at its bounds; masses, ratios and rotor inertias are normal and
        positive; all else is normal. All are cut at four sigma: a Latin hypercube of many samples reaches no further.
        """
        prior = None if self.shape is None else self.shape.prior
        if isinstance(prior, Uniform) and self.sigma >= _UNKNOWN * (prior.high - prior.low) / np.sqrt(12.0):
            return np.asarray(prior.low + (prior.high - prior.low) * probability)
        if isinstance(prior, LogNormal) and self.value > 0.0:
            # Median and standard deviation m, s: spread^2 = ln((1 + sqrt(1 + 4 (s/m)^2)) / 2).
            spread = np.sqrt(np.log(0.5 + np.sqrt(0.25 + (self.sigma / self.value) ** 2)))
            drawn = self.value * np.exp(spread * np.clip(norm.ppf(probability), -4.0, 4.0))
        else:
            low = -self.value / self.sigma if self.quantity.rsplit(".", 1)[-1] in _POSITIVE else -4.0
            drawn = truncnorm.ppf(probability, max(low, -4.0), 4.0, self.value, self.sigma)
        if self.shape is not None and not self.cyclic:
            drawn = np.clip(drawn, *self.shape.bounds)
        return np.asarray(drawn)


def uncertain(rig: Rig, effects: Sequence[Effect]) -> tuple[Uncertain, ...]:
    """Return every number of the plant with a sigma above zero, in the order of their names.

    The transducer, gravity and what else the laboratory does belong to a test, not to the article; drive parameters
    that no effect asks for do nothing.
    """
    shapes = {parameter.name: parameter for effect in effects for parameter in effect.parameters}
    drives = {
        quantity.name: shapes.get(name)
        for joint in rig.joints
        if joint.drive is not None
        for name, quantity in joint.drive.parameters.items()
    }
    found = []
    for name, quantity in sorted(rig.quantities().items()):
        if name.startswith(_NOT_THE_PLANT) or (name in drives and drives[name] is None):
            continue
        found.extend(_elements(quantity, drives.get(name)))
    return tuple(found)


def _elements(quantity: Quantity, shape: Parameter | None) -> list[Uncertain]:
    return [
        Uncertain(quantity.name, index, float(quantity.value[index]), float(sigma), shape)
        for index, sigma in np.ndenumerate(quantity.sigma)
        if sigma > 0.0
    ]


def draw(numbers: Sequence[Uncertain], samples: int, seed: int) -> Array:
    """Return (samples, numbers): one row a rig; the same for the same seed.

    Latin hypercube (McKay et al., Technometrics 21, 1979): each number takes one value in every one of `samples`
    equally probable intervals, which makes means converge faster than independent draws do.
    """
    unit = qmc.LatinHypercube(len(numbers), rng=np.random.default_rng(seed)).random(samples)
    return np.stack([number.at(column) for number, column in zip(numbers, unit.T, strict=True)], axis=1)


def values(rig: Rig, numbers: Sequence[Uncertain], row: Array) -> dict[str, Array | float]:
    """Return one drawn row as what `rig.model.substitute` takes."""
    quantities = rig.quantities()
    drawn: dict[str, Array] = {}
    for number, value in zip(numbers, row, strict=True):
        whole = drawn.setdefault(number.quantity, quantities[number.quantity].value.copy())
        whole[number.index] = value
    return dict(drawn)
