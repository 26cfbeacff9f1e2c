"""What encoder rounding does to the gravity fit: an error that belongs to the angle, not to the instant.

An encoder's rounding error is a function of the true angle. While a joint crosses codes faster than the fit's low-pass
it averages out; a joint at rest keeps one error for as long as it rests, in every recording that rests there, and no
residual shows it: masses, CoGs and tilt take it up. So the error is taken as one number a code, independent from code
to code, of the standard deviation that the low-pass leaves at each instant (step / sqrt(12) at rest). Where a joint
creeps, at about a code a second, it changes sign within a code, and this takes too much.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kbs_process.signals.records import Array
from kbs_process.stages.gravity.equation import Equation, Prepared


def rounding_scores(
    equation: Equation, theta: Array, prepared: Sequence[Prepared], sigmas: Sequence[Array], J: Array
) -> Array:
    """Covariance (p, p) of the scores J^T e through encoder rounding; J (n, p) of all recordings, whitened.

    e = (dW/dq) (error of the angle) / sigma, so that each code adds (sum of J^T e over its instants) squared.
    """
    slopes = np.concatenate(
        [
            equation.angle_slopes(theta, p) / sigma[:, None] * p.rounding[:, None, :]
            for p, sigma in zip(prepared, sigmas, strict=True)
        ]
    )
    readings = np.concatenate([p.q for p in prepared])
    by_instant = J.reshape(*slopes.shape[:2], -1)
    total = np.zeros((J.shape[1], J.shape[1]))
    for index, joint in enumerate(equation.elements.rig.joints):
        step = 0.0 if joint.encoder is None else float(joint.encoder.step)
        if step == 0.0:
            continue
        scores = np.einsum("nc,ncp->np", slopes[:, :, index], by_instant)
        codes, which = np.unique(np.round(readings[:, index] / step), return_inverse=True)
        by_code = np.zeros((len(codes), J.shape[1]))
        np.add.at(by_code, which, scores)
        total += by_code.T @ by_code
    return total
