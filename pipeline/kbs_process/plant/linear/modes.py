"""Resonances of the article on the elastic transducer, drives and gravity included, at a pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from kbs_process.plant.effect import Effect
from kbs_process.plant.linear.linearise import linearise
from kbs_process.rig.model import LAB, Rig
from kbs_process.signals.records import Array

AXES = "xyz"
# Only modes that turn the plate by this share of their strain energy are seen by the transducer.
SEEN = 0.02
MASSLESS = 1e-12  # of the greatest inertia


@dataclass(frozen=True, slots=True)
class Mode:
    """One mode in which the plate takes part."""

    axis: str  # of T, about which the plate turns most
    frequency: float  # Hz
    sigma: float  # Hz, from the uncertainty of the transducer's stiffness


def modes(rig: Rig, effects: Sequence[Effect], q: Array) -> tuple[Mode, ...]:
    """Return the modes at joint angles q (joints,) that turn the plate, lowest first; none on a rigid transducer.

    Undamped, about rest: gyroscopic terms are left out. See `linear.linearise` for what else is.
    """
    stiffness = rig.transducer.stiffness
    if stiffness is None or rig.transducer.on != LAB:
        return ()
    system = linearise(rig, effects, q)
    # What no mass turns, as a point on the axis, resonates beyond all frequencies.
    bare = MASSLESS * float(np.diag(system.M).max(initial=0.0))
    massless = float(np.linalg.eigvalsh(system.M)[0]) < bare
    squared, shapes = eigh(system.K, system.M + (bare * np.eye(len(system.M)) if massless else 0.0))
    found = []
    for value, shape in zip(squared, shapes.T, strict=True):
        # Shares of the strain energy: shapes are normed by M.
        plate = stiffness.value * shape[:3] ** 2 / value
        if plate.sum() > SEEN:
            frequency = float(np.sqrt(value) / (2 * np.pi))
            relative = 0.5 * float(np.linalg.norm(plate * stiffness.sigma / stiffness.value))
            found.append(Mode(AXES[int(np.argmax(plate))], frequency, frequency * relative))
    return tuple(found)
