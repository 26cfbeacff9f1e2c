"""The transducer amplifier's Butterworth low-pass, discretised exactly for inputs constant over a step."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from kbs_process.rig.model import Amplifier
from kbs_process.signals.records import Array


def discretised(amplifier: Amplifier | None, step: float) -> tuple[Array, Array]:
    """Return (A, b), shapes (order, order) and (order,): next = A state + b input; the last is the output.

    Equation: a chain of sections u -> (v, y), v' = w (u - y - 2 zeta v), y' = w v, with
        zeta = sin(pi (2k - 1) / (2 order)), behind one of first order where the order is odd.
    Units: Hz, s. In a steady state every y is u and every v is 0.
    Validity: any order and corner; an input that varies within a step counts with its mean.
    Source: S. Butterworth (1930); exact discretisation by the matrix exponential.
    """
    if amplifier is None:
        return np.zeros((0, 0)), np.zeros(0)
    order, w = amplifier.order, 2.0 * np.pi * float(amplifier.corner)
    system = np.zeros((order + 1, order + 1))  # the input is the last state, constant over a step
    source, k = order, 0
    if order % 2:
        system[0, [0, source]] = -w, w
        source, k = 0, 1
    for section in range(1, order // 2 + 1):
        zeta = np.sin(np.pi * (2 * section - 1) / (2 * order))
        system[k, [k, k + 1]] = -2.0 * zeta * w, -w
        system[k, source] += w
        system[k + 1, k] = w
        source, k = k + 1, k + 2
    exact = expm(system * step)
    return np.ascontiguousarray(exact[:order, :order]), np.ascontiguousarray(exact[:order, order])


def steady(order: int, wrench: Array) -> Array:
    """Return the states, shape (6, order), of an amplifier that has long seen `wrench`, shape (6,)."""
    outputs = (np.arange(order) % 2) != (order % 2)
    return np.ascontiguousarray(np.outer(wrench, outputs))
