"""Whether a friction takes work out of the mechanism: one that puts work in stands in for something else."""

from __future__ import annotations

import numpy as np

from kbs_process.diagnosis.proposing.curves import CurveSuspect, along
from kbs_process.diagnosis.screening.screen import Catalogued
from kbs_process.diagnosis.screening.signature import port_inputs
from kbs_process.diagnosis.screening.suspects import Candidate
from kbs_process.plant.effect import Effect
from kbs_process.signals.records import Array

_SHARE = 0.1  # of the work that it does and takes, below which what it does is the motion's asymmetry
SIGMAS = 3.0  # by which work has to be done for a friction to be refused


def drives(suspect: Catalogued, amplitudes: Array, covariance: Array) -> tuple[str, ...]:
    r"""Return why a friction of such amplitudes (m,), covariance (m, m), is none; nothing, if it may be one.

    Equation: $W = \sum_j a_j \sum_t T_j(t) \omega(t) \, dt$ over all trajectories, $T_j$ the torque of a unit of
        amplitude j at the screen's shape, $\omega$ the rate at its port.
    Units: N m, rad/s, s -> J.
    Validity: work that is done counts where it is more than a tenth of all that is done and taken. The friction of
        the nominal model is known to its sigmas and refitted: less of it is no find.
    Source: J. C. Willems, Dissipative dynamical systems I, Arch. Rational Mech. Anal. 45 (1972) 321.
    """
    candidate = suspect.candidate
    if not (isinstance(candidate.effect, Effect) and candidate.effect.brakes):
        return ()
    # Several actions of one law have amplitudes one after the other.
    actions = len(amplitudes) // len(candidate.amplitudes)
    power = np.tile(_power(suspect, candidate, candidate.port.rate), actions)
    work, all_of_it = power.sum(axis=0), float(np.abs(power @ amplitudes).sum())
    done, variance = float(work @ amplitudes), float(work @ (covariance @ work))
    if not done > max(SIGMAS * float(np.sqrt(max(variance, 0.0))), _SHARE * all_of_it):
        return ()
    return (f"does work of {done:.3g} J in these motions, and friction takes it",)


def pushes(suspect: CurveSuspect, coefficients: Array, covariance: Array) -> tuple[str, ...]:
    """Return why a measured friction is none: along its table it pushes more than it brakes; nothing, if it may be."""
    if not suspect.law.opposed:
        return ()
    mean = suspect.basis(along(suspect.law, *suspect.ends)).mean(axis=0)
    value, variance = float(mean @ coefficients), float(mean @ covariance @ mean)
    if not value < -SIGMAS * float(np.sqrt(max(variance, 0.0))):
        return ()
    return (f"pushes with {-value:.3g} N m along its table, and friction brakes",)


def _power(suspect: Catalogued, candidate: Candidate, rate: str) -> Array:
    """(n, m) J that a unit of each amplitude does from tap to tap, along all trajectories end to end."""
    scene = suspect.scene
    parts = []
    for tapped in scene.signals.values():
        torque = port_inputs(candidate, tapped, scene.hypothesis.rig)[:, :, 0]
        speed = tapped.values[:, tapped.columns.index(f"{rate}.{candidate.site}")]
        parts.append(torque * speed[:, None] / tapped.rate)
    return np.concatenate(parts)
