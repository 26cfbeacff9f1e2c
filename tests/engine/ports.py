"""Where physics beyond the engine's own drives can enter a simulation; nothing does by itself.

An `Extra` acts at any of the engine's ports. Its compiled part, `act`, is called once a step::

    act(t, dt, numbers, memory, motion, bodies, out)

- `t`: instant, s; `dt`: step, s (0 while the static start is sought: states have to stay as they are)
- `numbers`: the extra's own (k, n) float64; `memory`: its states (k, m) float64, 0 at the start, kept from step to step
- `motion` (3, 7): positions, rates, and in the first two of the last row the fields of az and el (motor rad).
  Columns: plate x, y, z, rotor az, az, rotor el, el
- `bodies` (2, 21): azimuth body, antenna: origin (3) and axes (9, row by row) of its frame, its centre of mass (3), all
  in undeflected T; for what an appendage feels, acceleration less gravity of its origin (3), angular acceleration (3)
- `out` (24,), zero before the call: generalised forces in the columns' order (7); force and torque from the laboratory
  on the azimuth body (6) and on the antenna (6), in undeflected T, torque about their centre of mass; acceleration of
  the floor (3); what the rotors' torques lose with their rates (2), N m s/rad, by which a steep friction is implicit
- rates of the rotors are those at the step's start, other rates are extrapolated to its middle
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numba import njit

from engine.hardware import Array

# Places in `out`.
GENERALISED, ON_AZIMUTH, ON_ANTENNA, FLOOR = slice(0, 7), slice(7, 13), slice(13, 19), slice(19, 22)
OUT = 24
BODY = 21

# Columns of a disturbance.
BY_FLOOR, BY_JOINTS, BY_ROTORS = slice(0, 3), slice(3, 5), slice(5, 7)
DISTURBANCE_STEP = 2e-3  # s
AT_REST = 0.1  # share of the joints' disturbance that is left where the field rests
_SLOWLY = 2e-5  # rad/s of the output, commanded: half of the rest of it

Act = Callable[..., None]
FieldChange = Callable[[int, Array, Array], Array]
EncoderChange = Callable[[Array, Array, Array], Array]
TransducerChange = Callable[[Array, Array], Array]
ClockChange = Callable[[Array], Array]


@njit(error_model="numpy")
def nothing(
    t: float, dt: float, numbers: Any, memory: Any, motion: Any, bodies: Any, out: Any
) -> None:  # pragma: no cover
    """Leave everything as it is."""


@njit(error_model="numpy")
def disturb(disturbance: Any, t: float, rates: Any, out: Any) -> None:
    """Add what acts at random at t (s) to `out`, while the joints are commanded at `rates` (2,), rad/s."""
    x = t / DISTURBANCE_STEP
    row = min(int(x), len(disturbance) - 2)
    x -= row
    for k in range(3):
        out[19 + k] += (1 - x) * disturbance[row, k] + x * disturbance[row + 1, k]
    for axis in range(2):
        share = AT_REST + (1 - AT_REST) * abs(rates[axis]) / (abs(rates[axis]) + _SLOWLY)
        for column, place, level in ((3, 4, share), (5, 3, 1.0)):
            value = (1 - x) * disturbance[row, column + axis] + x * disturbance[row + 1, column + axis]
            out[place + 2 * axis] += level * value


@dataclass(frozen=True, slots=True, eq=False)
class Extra:
    """What acts beyond the engine's own physics. The default acts nowhere, to the bit."""

    act: Act = nothing
    numbers: Array = field(default_factory=lambda: np.zeros((0, 1)))  # (k, n)
    states: int = 1  # columns of its memory
    # (cycle k, field commanded at its start (2,), at its end (2,)) -> what the motor's field does not do of the end
    drive: FieldChange | None = None
    # (t (n,), joint angles (n, 2), rates (n, 2)) -> change (n, 2) of what the discs show, rad
    encoder: EncoderChange | None = None
    # (t (n,), wrench (n, 6) behind cross-coupling) -> change (n, 6) of the reading before noise and rounding
    transducer: TransducerChange | None = None
    # (rows, 7) every DISTURBANCE_STEP, linear between: acceleration of the floor (3), m/s^2, torque on the outputs az
    # and el, reacted by their carriers, and on the rotors, N m
    disturbance: Array = field(default_factory=lambda: np.zeros((0, 7)))
    # "wrench" and "encoder" -> (true t (n,)) -> change (n,) of the clock's reading, s
    clocks: Mapping[str, ClockChange] = field(default_factory=dict)

    @property
    def acts(self) -> bool:
        """Whether anything acts on the mechanism."""
        return self.act is not nothing or len(self.disturbance) > 0


NONE = Extra()
