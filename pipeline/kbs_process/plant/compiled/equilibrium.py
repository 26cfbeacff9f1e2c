"""Static equilibrium of the plant: base sag, windup of the gears, lag of the rotors behind their fields."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from kbs_process.errors import DivergenceError
from kbs_process.plant.compiled.compile import Compiled
from kbs_process.plant.compiled.stepping import state_layout
from kbs_process.plant.structure import JOINTS, MICROSTEP, RATIO, Structure
from kbs_process.signals.records import Array

ITERATIONS = 60
STANDSTILL = 1e-6  # rad/s^2, of base, outputs and rotors
ROUNDING = 1e-8  # of the same, below which there is nothing to look for
GAINED = 0.1  # share left at a standstill by a step that did not meet rounding
LEAST_SHARE = 1e-4  # of a step
# rad, by which gears are wound up to begin with: one with play has no stiffness unloaded
WOUND = (0.0, 3e-4, 2.1e-3, 1.1e-2)
UNHELD = 1e8  # condition of the accelerations' slopes above which something turns freely; held, it is some 1e5


def at_rest(plant: Compiled, structure: Structure, p: Array, field: Array) -> tuple[Array, Array]:
    """Return state and wrench in static equilibrium with `field`, in microsteps, shape (joints,).

    Newton's method from the unloaded position, or from a wound up one where that fails. Coulomb friction carries
    nothing there: with the smooth torques in balance it need not, and what it could hold beside that depends on a
    history nobody knows.
    """
    layout = state_layout(structure)
    x = np.zeros(max(part.stop for part in layout.values()))
    offsets = JOINTS + np.arange(structure.joints) * structure.stride
    x[layout["theta"]] = np.floor(field + 0.5) / p[offsets + MICROSTEP]
    x[layout["q"]] = x[layout["theta"]] / p[offsets + RATIO]
    x[layout["z"]] = np.tile(structure.states, structure.joints)
    x[layout["y"]] = structure.mounted
    free = np.concatenate(
        [np.arange(x.size)[layout[name]] for name in (("alpha",) if structure.elastic else ()) + ("q", "theta")]
    )
    rows = np.arange(0 if structure.elastic else 3, 3 + 2 * structure.joints)

    def acceleration(values: Array) -> Array:
        trial = x.copy()
        trial[free] = values
        out = np.empty(3 + 2 * structure.joints)
        plant.balance(trial, field, p, out)
        return out[rows]

    unloaded = x[free]
    outputs = slice(rows.size - 2 * structure.joints, rows.size - structure.joints)
    falling = acceleration(unloaded)[outputs]
    pushed = np.sign(falling) * (np.abs(falling) > STANDSTILL)
    for wound in WOUND:
        start = unloaded.copy()
        start[outputs] += wound * pushed
        values, residual = _settled(acceleration, start)
        if np.abs(residual).max() < STANDSTILL:
            break
    else:
        raise DivergenceError(
            "no static equilibrium at the first command: a motor cannot hold its load there",
            remedy="check Tmax and ratio of the drives, and mass and CoG of the bodies",
        )
    x[free] = values
    wrench = np.array(plant.balance(x, field, p, np.empty(3 + 2 * structure.joints)))
    return x, wrench


def _settled(acceleration: Callable[[Array], Array], values: Array) -> tuple[Array, Array]:
    """Position to which Newton's method leads from `values`, and the accelerations left there."""
    residual = acceleration(values)
    for _ in range(ITERATIONS):
        if np.abs(residual).max() < ROUNDING:
            break
        jacobian = np.stack([_slope(acceleration, values, i) for i in range(len(values))], axis=1)
        change = -_solved(jacobian, residual)
        size, still = float(np.linalg.norm(residual)), np.abs(residual).max() < STANDSTILL
        share, left = 1.0, acceleration(values + change)
        while not still and np.linalg.norm(left) > size and share > LEAST_SHARE:
            share *= 0.5
            left = acceleration(values + share * change)
        if not np.linalg.norm(left) < size:
            break  # rounding is all that is left, or there is no equilibrium
        values, residual = values + share * change, left
        if still and not np.linalg.norm(left) < GAINED * size:
            break
    return values, residual


def _solved(jacobian: Array, residual: Array) -> Array:
    """Solution; the least one where nothing holds a joint, as within the play of a gear without load."""
    if np.linalg.cond(jacobian) < UNHELD:
        return np.asarray(np.linalg.solve(jacobian, residual), dtype=np.float64)
    return np.asarray(np.linalg.lstsq(jacobian, residual, rcond=1.0 / UNHELD)[0], dtype=np.float64)


def _slope(function: Callable[[Array], Array], values: Array, i: int) -> Array:
    """Return the central difference of `function` along coordinate `i`."""
    apart = np.zeros_like(values)
    apart[i] = 1e-7
    return (function(values + apart) - function(values - apart)) / 2e-7
