"""What encoder rounding does to the gravity fit: an error that belongs to the angle, not to the instant.

An encoder's rounding error is a function of the true angle. While a joint crosses codes faster than the fit's low-pass
it averages out; a joint at rest keeps one error for as long as it rests, in every recording that rests there, and no
residual shows it: masses, CoGs and tilt take it up. So the error is taken as one number a code, independent from code
to code, of the standard deviation that the low-pass leaves at each instant (step / sqrt(12) at rest). Where a joint
creeps, at about a code a second, it changes sign within a code, and this takes too much.
"""

from __future__ import annotations

import numpy as np

from kbs_process.signals.records import Array
from kbs_process.stages.gravity.equation import Equation, Prepared
from kbs_process.stages.gravity.parameters import Index


class Rounding:
    """Covariance (p, p) of the scores J^T e through encoder rounding, recording by recording.

    e = (dW/dq) (error of the angle) / sigma, so that each code adds (sum of J^T e over its instants) squared.
    """

    def __init__(self, equation: Equation, theta: Array, size: int) -> None:
        """`size` is p, that of all recordings."""
        self._equation, self._theta, self._size = equation, theta, size
        encoders = [joint.encoder for joint in equation.elements.rig.joints]
        self._steps = [0.0 if encoder is None else float(encoder.step) for encoder in encoders]
        self._sums: list[list[tuple[Array, Array]]] = [[] for _ in self._steps]

    def add(self, p: Prepared, sigma: Array, J: Array, at: Index) -> None:
        """Take a recording's J (n, c, k), whitened by `sigma` (c,), of the parameters that are `at` (k,)."""
        slopes = self._equation.angle_slopes(self._theta, p) / sigma[:, None] * p.rounding[:, None, :]
        for index, step in enumerate(self._steps):
            if step > 0.0:
                codes, which = np.unique(np.round(p.q[:, index] / step), return_inverse=True)
                by_code = np.zeros((len(codes), self._size))
                np.add.at(by_code, (which[:, None], at), np.einsum("nc,ncp->np", slopes[:, :, index], J))
                self._sums[index].append((codes, by_code))

    def scores(self) -> Array:
        """The covariance, of all recordings: one that rests where another did errs alike."""
        total = np.zeros((self._size, self._size))
        for sums in filter(None, self._sums):
            codes, by_recording = map(np.concatenate, zip(*sums, strict=True))
            every, which = np.unique(codes, return_inverse=True)
            by_code = np.zeros((len(every), self._size))
            np.add.at(by_code, which, by_recording)
            total += by_code.T @ by_code
        return total
