"""Inertia tensors among the numbers of a fit: no body has one with a negative principal moment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kbs_process.signals.records import Array

_PRODUCTS = np.arange(6) > 2  # of elements xx, yy, zz, xy, xz, yz
_ROUNDING = 1e-10  # of the greatest element
_HALVINGS = 50
_EDGE = 1e-6  # of the products: as close to none of a body, a tensor is at its bound


@dataclass(frozen=True, slots=True, eq=False)
class Tensors:
    """Where the elements of some tensors are among the numbers, and what those are that are not free."""

    index: NDArray[np.intp]  # (k, 6), -1 of an element that is not free
    value: Array  # (k, 6) kg m^2, to begin with

    @classmethod
    def among(cls, names: Sequence[str], tensors: Mapping[str, Array]) -> Tensors:
        """Those `tensors` that have an element among `names`, which are like `body.head.inertia[0]`."""
        places = {name: place for place, name in enumerate(names)}
        found = {name: [places.get(f"{name}[{element}]", -1) for element in range(6)] for name in tensors}
        free = [name for name, index in found.items() if max(index) >= 0]
        index = np.array([found[name] for name in free], dtype=np.intp).reshape(-1, 6)
        return cls(index, np.array([tensors[name] for name in free]).reshape(-1, 6))

    def chosen(self, places: Sequence[int]) -> Tensors:
        """The same where of the numbers those at `places` are left, in that order; the others are as at the start."""
        new = {old: place for place, old in enumerate(places)}
        index = [[new.get(int(old), -1) for old in row] for row in self.index]
        return Tensors(np.array(index, dtype=np.intp).reshape(-1, 6), self.value)

    def bodily(self, theta: Array) -> Array:
        """Numbers (p,) with every tensor's products of inertia made so small that it is one of a body.

        Its moments, which must not be negative, stay. Where products that are not free are too great for them, the
        tensor is that on the way to its start.
        """
        result = theta
        for index, start in zip(self.index, self.value, strict=True):
            free = index >= 0
            wanted = np.where(free, theta[index], start)
            if _is_bodily(wanted):
                continue
            begin = np.where(free & _PRODUCTS, 0.0, wanted)
            if not _is_bodily(begin):
                begin, wanted = start, begin
            result = result.copy()
            result[index[free]] = _farthest(begin, wanted)[free]
        return result

    def at_edge(self, theta: Array) -> set[int]:
        """Places of the numbers of tensors that would be no body's with products a little greater."""
        edge = set[int]()
        for index, start in zip(self.index, self.value, strict=True):
            tensor = np.where(index >= 0, theta[index], start)
            if not _is_bodily(np.where(_PRODUCTS, (1.0 + _EDGE) * tensor, tensor)):
                edge |= set(index[index >= 0].tolist())
        return edge


def _is_bodily(tensor: Array) -> bool:
    """Whether no principal moment of a tensor (6,) is negative, but for rounding."""
    xx, yy, zz, xy, xz, yz = tensor
    least = float(np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])[0])
    return least >= -_ROUNDING * float(np.abs(tensor).max())


def _farthest(begin: Array, end: Array) -> Array:
    """The last tensor of a body on the way from one, `begin`, to `end`: they are a convex set."""
    share = 0.0
    for step in 0.5 ** np.arange(1, _HALVINGS):
        if _is_bodily(begin + (share + step) * (end - begin)):
            share += step
    reached: Array = begin + share * (end - begin)
    return reached
