"""What the gravity fit may change: elements of the rig's quantities, each with the rig file's sigma as its prior."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from kbs_process.plant.rigid import links_beyond
from kbs_process.rig.model import Joint, Quantity, Rig, substitute
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Mask

CROSS_COUPLING = "transducer.cross_coupling"
Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class RigElements:
    """Free elements of the rig's quantities, in a vector."""

    rig: Rig
    quantities: tuple[Quantity, ...]
    masks: tuple[Mask, ...]  # of each quantity's shape

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(
            element_name(quantity.name, tuple(int(i) for i in index))
            for quantity, mask in zip(self.quantities, self.masks, strict=True)
            for index in np.argwhere(mask)
        )

    @cached_property
    def value(self) -> Array:
        return self._gather([quantity.value for quantity in self.quantities])

    @cached_property
    def sigma(self) -> Array:
        return self._gather([quantity.sigma for quantity in self.quantities])

    @cached_property
    def lower(self) -> Array:
        """Least that each may be."""
        return self._gather([np.asarray(quantity.low) for quantity in self.quantities])

    def _gather(self, arrays: list[Array]) -> Array:
        parts = [array[mask] for array, mask in zip(arrays, self.masks, strict=True)]
        return np.concatenate(parts) if parts else np.zeros(0)

    def rig_at(self, theta: Array, sigma: Array | None = None) -> Rig:
        """The rig with its free elements at `theta`, and their sigmas, where given."""
        values: dict[str, Array | float] = {}
        sigmas: dict[str, Array | float] = {}
        start = 0
        for quantity, mask in zip(self.quantities, self.masks, strict=True):
            stop = start + int(mask.sum())
            values[quantity.name] = _filled(quantity.value, mask, theta[start:stop])
            if sigma is not None:
                sigmas[quantity.name] = _filled(quantity.sigma, mask, sigma[start:stop])
            start = stop
        return substitute(self.rig, values, sigmas)

    def moved(self, rig: Rig, theta: Array, part: float) -> Iterator[Rig]:
        """The rig at `theta`, with one free element after the other moved by `part` of its sigma; else it is `rig`."""
        ends = np.cumsum([int(mask.sum()) for mask in self.masks])
        for quantity, mask, end in zip(self.quantities, self.masks, ends, strict=True):
            own = slice(end - int(mask.sum()), end)
            for step in np.diag(part * self.sigma[own]):
                yield substitute(rig, {quantity.name: _filled(quantity.value, mask, theta[own] + step)})


def rig_elements(rig: Rig, *, include_inertia: bool) -> RigElements:
    """All elements with a prior sigma above zero of the quantities that shape the recorded loads."""
    free = [q for q in _candidates(rig, include_inertia) if np.any(q.sigma > 0.0)]
    return RigElements(rig, tuple(free), tuple(q.sigma > 0.0 for q in free))


def coupling_elements(rig: Rig) -> tuple[Index, Index, tuple[str, ...]]:
    """Row and column indices of the cross-coupling's free elements (rows: recorded channels), and their names."""
    recorded = np.isin(WRENCH_CHANNELS, rig.transducer.channels)
    free = (rig.transducer.cross_coupling.sigma > 0.0) & recorded[:, None]
    rows, columns = np.nonzero(free)
    names = tuple(element_name(CROSS_COUPLING, (int(i), int(j))) for i, j in zip(rows, columns, strict=True))
    return rows, columns, names


def element_name(name: str, index: tuple[int, ...]) -> str:
    return f"{name}[{','.join(map(str, index))}]" if index else name


def _candidates(rig: Rig, include_inertia: bool) -> Iterator[Quantity]:
    beyond = links_beyond(rig).union(*(links_beyond(rig, joint.name) for joint in _driven(rig)))
    for body in rig.bodies:
        if body.on in beyond:
            yield body.mass
            yield body.cog
            if include_inertia:
                yield body.inertia
    yield rig.transducer.tilt
    if rig.transducer.stiffness is not None:
        yield rig.transducer.stiffness
    for joint in rig.joints:
        yield joint.origin
        yield joint.misalignment
        if joint.encoder is not None:
            yield joint.encoder.offset
    for joint in _driven(rig):
        assert joint.effort is not None
        yield joint.effort.gain
        if include_inertia and joint.viscous is not None:
            yield joint.viscous


def _driven(rig: Rig) -> list[Joint]:
    """Joints whose effort is measured."""
    return [joint for joint in rig.joints if joint.effort is not None]


def _filled(array: Array, mask: Mask, values: Array) -> Array:
    filled = array.copy()
    filled[mask] = values
    return filled
