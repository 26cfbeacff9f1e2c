"""The mounting's own moment on the plate: where the plate comes to rest on it, and how it yields there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kbs_process.plant.effect import MOUNTING_SIGNALS, Effect, Port
from kbs_process.plant.external import external_wrench
from kbs_process.plant.rigid import inverse_dynamics
from kbs_process.plant.structure import external_of
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array

_STEP = 1e-6  # rad and rad/s, of central differences
_ANGLES = ("base_x", "base_y", "base_z")
_RATES = ("base_rate_x", "base_rate_y", "base_rate_z")
_ITERATIONS = 20
_AT_REST = 1e-10  # rad


def mounted_sag(rig: Rig, effects: Sequence[Effect], q: Array) -> Array:
    r"""Return the angles (3,) at which the plate rests at joint angles q (joints,), rad.

    Equation: $K \alpha = m + M(\alpha)$ with m the moment of weight and other loads on the springs K, and M that of the
        mounting beyond them; by Newton's method. Zero without such a mounting, whose slopes need no place then.
    Validity: gears do not yield, states of the mounting are those that it begins with.
    """
    alpha = np.zeros(3)
    if not any(effect.port is Port.BASE_TORQUE for effect in effects):
        return alpha
    assert rig.transducer.stiffness is not None
    K, pose = rig.transducer.stiffness.value, np.asarray(q, dtype=float)[None, :]
    still = np.zeros_like(pose)
    load = (inverse_dynamics(rig, pose, still, still) + external_wrench(rig, effects, pose))[0, 3:]
    for _ in range(_ITERATIONS):
        stiffness, _ = mounted_slopes(rig, effects, alpha)
        left = load + _moment(rig, effects, dict(zip(_ANGLES, alpha.tolist(), strict=True))) - K * alpha
        step = np.linalg.solve(np.diag(K) + stiffness, left)
        alpha = alpha + step
        if not np.abs(step).max() > _AT_REST:
            break
    return alpha


def mounted_slopes(rig: Rig, effects: Sequence[Effect], alpha: Array) -> tuple[Array, Array]:
    """Return stiffness and damping (3, 3) of the mounting beyond the transducer's at angles alpha (3,), rad.

    N m/rad and N m s/rad; states are held, as a mounting that slips has them while the plate goes on.
    """
    at = dict(zip(_ANGLES, np.asarray(alpha).tolist(), strict=True))

    def slopes(signals: Sequence[str]) -> Array:
        ends = [
            [_moment(rig, effects, at | {name: at.get(name, 0.0) + step}) for name in signals]
            for step in (_STEP, -_STEP)
        ]
        change = np.array(ends[0]) - np.array(ends[1])
        return np.asarray(-change.T / (2.0 * _STEP), dtype=np.float64)

    return slopes(_ANGLES), slopes(_RATES)


def _moment(rig: Rig, effects: Sequence[Effect], signals: dict[str, float]) -> Array:
    """Moment (3,) of the mounting at some of its signals, the others zero."""
    total = np.zeros(3)
    for effect in effects:
        if effect.port is Port.BASE_TORQUE:
            known = dict.fromkeys(MOUNTING_SIGNALS, 0.0) | signals
            known |= {name: float(number) for name, number in external_of(rig, effect).parameters.items()}
            total += effect.value(known)
    return total
