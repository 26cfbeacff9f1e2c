"""Resonances of the article on the elastic transducer, drives locked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from kbs_process.plant.rigid import inertia_matrix, kinematics, links_beyond
from kbs_process.rig.model import TRANSDUCER, Rig
from kbs_process.signals.frames import rotate
from kbs_process.signals.records import Array

AXES = "xyz"


@dataclass(frozen=True, slots=True)
class Mode:
    """One rocking mode of the article on the transducer."""

    axis: str  # of T, about which it turns most
    frequency: float  # Hz
    sigma: float  # Hz, from the uncertainty of the stiffness


def inertia_on_transducer(rig: Rig, q: Array) -> Array:
    """Inertia (3, 3) about T's origin, in T's axes, of everything beyond T at joint angles q (joints,), kg m^2."""
    rest = np.zeros((1, len(q)))
    links = kinematics(rig, q[None, :], rest, rest)
    T = links[TRANSDUCER]
    R_TL = T.R[0].T
    total = np.zeros((3, 3))
    for body in rig.bodies:
        if body.on not in links_beyond(rig):
            continue
        link = links[body.on]
        R = R_TL @ link.R[0]
        r = R_TL @ (link.r + rotate(link.R, body.cog.value) - T.r)[0]
        total += R @ inertia_matrix(body.inertia.value) @ R.T
        total += float(body.mass) * (r @ r * np.eye(3) - np.outer(r, r))
    return total


def rocking_modes(rig: Rig, q: Array) -> tuple[Mode, ...]:
    """Return the modes K x = w^2 I x at joint angles q (joints,), lowest first; none on a rigid transducer.

    Valid for small damping, and as far as the drives are stiffer than the transducer: a compliant drive lowers them.
    """
    stiffness = rig.transducer.stiffness
    if stiffness is None:
        return ()
    squared, shapes = eigh(np.diag(stiffness.value), inertia_on_transducer(rig, q))
    modes = []
    for value, shape in zip(squared, shapes.T, strict=True):
        energy = stiffness.value * shape**2  # share of the strain energy about each axis
        share = energy / energy.sum()
        relative = 0.5 * np.linalg.norm(share * stiffness.sigma / stiffness.value)
        frequency = float(np.sqrt(value) / (2 * np.pi))
        modes.append(Mode(AXES[int(np.argmax(share))], frequency, float(frequency * relative)))
    return tuple(modes)
