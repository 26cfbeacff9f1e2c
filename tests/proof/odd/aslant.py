"""A law in no catalogue, nor drawn in any trial: a spring of the mounting whose axis is none of the plate's."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

import numpy as np
from numba import njit

from engine.ports import Extra
from proof.concealed.physics import Effect, Physics, Shape


class Law(IntEnum):
    """Torque -A n (n . phi) on the plate, phi its three angles, n the unit vector along s0..2."""

    ASLANT = 1


PHYSICS = Physics(
    "spring of the mounting, aslant", "base", "unnamed", Law.ASLANT, ("",), "N m/rad", 1e3, 1e6,
    tuple(Shape(f"axis {name}", "", 0.0) for name in "xyz"), catalogued=False,
)  # fmt: skip


def extra(effect: Effect) -> Extra:
    """What the engine lets act."""
    axis = np.array(effect.shapes)
    return Extra(act=_act, numbers=np.array([[effect.amplitude, *axis / np.linalg.norm(axis)]]))


@njit(error_model="numpy", cache=True)
def _act(t: float, dt: float, numbers: Any, memory: Any, motion: Any, bodies: Any, out: Any) -> None:
    """Act once; see engine.ports."""
    along = 0.0
    for k in range(3):
        along += numbers[0, 1 + k] * motion[0, k]
    for k in range(3):
        out[k] -= numbers[0, 0] * numbers[0, 1 + k] * along
