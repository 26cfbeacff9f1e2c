"""How far apart two laws are on these recordings, each refitted: which of them it is, and how sure that is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import softmax

from kbs_process.diagnosis.nominal.known import Known
from kbs_process.signals.records import Array


def distance(accepted: Known, rival: Known) -> float:
    """Whitened distance of two refitted models' predictions over the fit trials, rho_delta.

    It is less what the rival's numbers could still take. The likelier is the wrong one with Q(rho_delta / 2).
    Both residuals are of the same recordings in the same metric: they differ by the predictions.
    """
    H = np.diag(rival.precision)
    h = np.zeros(len(H))
    total = 0.0
    for k in rival.experiment.fit:
        apart = rival.residual[k] - accepted.residual[k]
        J = rival.jacobian(k)
        H, h, total = H + J.T @ J, h + J.T @ apart, total + float(apart @ apart)
    size = 1.0 / np.sqrt(np.maximum(np.diag(H), 1e-300))
    factor = cho_factor(H * np.outer(size, size) + 1e-12 * np.eye(len(H)))
    taken = float((size * h) @ cho_solve(factor, size * h))
    return float(np.sqrt(max(total - taken, 0.0)))


def evidences(models: Sequence[Known], rows: int, fitted: Sequence[int] = ()) -> Array:
    """(models,) log evidence of each, less a constant: Schwarz's criterion of the refitted non-linear models.

    `fitted` numbers were taken off the recordings before, beside those that are free in a model.
    """
    count = np.array([len(model.free) for model in models]) + (np.array(fitted) if fitted else 0)
    return np.asarray(-0.5 * np.array([model.cost for model in models]) - 0.5 * count * np.log(rows))


def probabilities(models: Sequence[Known], rows: int, fitted: Sequence[int] = ()) -> Array:
    """(models,) that each is right, one of them being so."""
    return softmax(evidences(models, rows, fitted))
