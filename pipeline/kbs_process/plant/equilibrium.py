"""Static equilibrium of the plant: base sag, windup of the gears, lag of the rotors behind their fields."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from kbs_process.errors import SimulationError
from kbs_process.plant.compile import Compiled
from kbs_process.plant.stepping import state_layout
from kbs_process.plant.structure import JOINTS, MICROSTEP, RATIO, Structure
from kbs_process.signals.records import Array

ITERATIONS = 60
STANDSTILL = 1e-6  # rad/s^2, of base, outputs and rotors


def at_rest(plant: Compiled, structure: Structure, p: Array, field: Array) -> tuple[Array, Array]:
    """Return state and wrench in static equilibrium with `field`, in microsteps, shape (joints,).

    Newton's method from the unloaded position. Coulomb friction carries nothing there: with the smooth
    torques in balance it need not, and what it could hold beside that depends on a history nobody knows.
    """
    layout = state_layout(structure)
    x = np.zeros(max(part.stop for part in layout.values()))
    offsets = JOINTS + np.arange(structure.joints) * structure.stride
    x[layout["theta"]] = np.floor(field + 0.5) / p[offsets + MICROSTEP]
    x[layout["q"]] = x[layout["theta"]] / p[offsets + RATIO]
    x[layout["z"]] = np.tile(structure.states, structure.joints)
    free = np.concatenate(
        [
            np.arange(x.size)[layout[name]]
            for name in (("alpha",) if structure.elastic else ()) + ("q", "theta")
        ]
    )
    rows = np.arange(0 if structure.elastic else 3, 3 + 2 * structure.joints)

    def acceleration(values: Array) -> Array:
        trial = x.copy()
        trial[free] = values
        out = np.empty(3 + 2 * structure.joints)
        plant.balance(trial, field, p, out)
        return out[rows]

    values, residual = x[free], acceleration(x[free])
    for _ in range(ITERATIONS):
        jacobian = np.stack([_slope(acceleration, values, i) for i in range(len(values))], axis=1)
        change = -np.linalg.solve(jacobian, residual)
        share = 1.0
        while (norm := float(np.linalg.norm(acceleration(values + share * change)))) > np.linalg.norm(
            residual
        ):
            share *= 0.5
            if share < 1e-4:
                break
        if share < 1e-4 or not np.isfinite(norm):
            break  # rounding is all that is left, or there is no equilibrium
        values = values + share * change
        residual = acceleration(values)
    if not np.abs(residual).max() < STANDSTILL:
        raise SimulationError(
            "no static equilibrium at the first command: a motor cannot hold its load there",
            remedy="check Tmax and ratio of the drives, and mass and CoG of the bodies",
        )
    x[free] = values
    wrench = np.array(plant.balance(x, field, p, np.empty(3 + 2 * structure.joints)))
    return x, wrench


def _slope(function: Callable[[Array], Array], values: Array, i: int) -> Array:
    """Return the central difference of `function` along coordinate `i`."""
    apart = np.zeros_like(values)
    apart[i] = 1e-7
    return (function(values + apart) - function(values - apart)) / 2e-7
