"""A law in no catalogue, nor drawn in any trial: an over-centre spring that flips at either end of a sector."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

import numpy as np
from numba import njit

from engine.hardware import AXES
from engine.ports import Extra
from proof.concealed.physics import Effect, Physics, Shape

_STATES = 3  # side, smoothed side, whether it has begun


class Law(IntEnum):
    """A y on the joint; side 1 below `s0`, -1 above `s1`, kept in between; y follows the side within s2."""

    LATCH = 1


PHYSICS = Physics(
    "over-centre clip", "joint torque", "unnamed", Law.LATCH, AXES, "N m", 0.5, 20.0,
    (Shape("goes over below", "rad", 0.0), Shape("goes over above", "rad", 0.0), Shape("time", "s", 0.0)),
    catalogued=False,
)  # fmt: skip


def extra(effect: Effect) -> Extra:
    """What the engine lets act."""
    row = [AXES.index(effect.place), effect.amplitude, *effect.shapes]
    return Extra(act=_act, numbers=np.array([row], dtype=float), states=_STATES)


@njit(error_model="numpy", cache=True)
def _act(t: float, dt: float, numbers: Any, memory: Any, motion: Any, bodies: Any, out: Any) -> None:
    """Act once; see engine.ports."""
    axis, A, low, high, time = numbers[0]
    z = memory[0]
    joint = 4 + 2 * int(axis)
    angle = motion[0, joint]
    if z[2] == 0.0:
        side = 1.0 if angle < 0.5 * (low + high) else -1.0
        if dt == 0.0:  # the static start is sought
            out[joint] += A * side
            return
        z[0], z[1], z[2] = side, side, 1.0
    if angle > high:
        z[0] = -1.0
    elif angle < low:
        z[0] = 1.0
    z[1] += dt / time * (z[0] - z[1])
    out[joint] += A * z[1]
