"""Sparse regression on the residual, as PySINDy's users do it.

Effort: the library of `library.py` (some 60 terms, columns scaled), PySINDy's ensemble of sequentially thresholded
least squares (20 bootstrap samples), threshold and ridge chosen by leaving one trajectory out, terms kept that at
least 60 % of the ensemble holds (Fasel, Kutz, Brunton & Brunton, Proc. R. Soc. A 478, 2022). No p-value: it has none.
"""

from __future__ import annotations

import warnings
from time import monotonic

import numpy as np

from proof.answer import Answer
from proof.rivals.case import Array, Case
from proof.rivals.regress import Problem, answer, least_squares

_THRESHOLDS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0)  # floor rms: what a term must move a channel by
_MODELS = 20
_INCLUDED = 0.6
_RIDGE = 0.05


def solve(case: Case) -> Answer:
    """Return the answer of the ensemble."""
    begin = monotonic()
    problem = Problem.of(case)
    threshold = _best_threshold(problem)
    chosen = _ensemble(problem.X, problem.Y, threshold) >= _INCLUDED
    coefficients = _refitted(problem, chosen)
    return answer("sparse", problem, coefficients, log10_p=None, seconds=monotonic() - begin)


def _ensemble(X: Array, Y: Array, threshold: float) -> Array:
    """Share of the ensemble (terms, c) that holds each term."""
    with warnings.catch_warnings():  # PySINDy warns where a threshold leaves nothing: an answer here
        warnings.simplefilter("ignore")
        import pysindy

        np.random.seed(0)  # noqa: NPY002 - PySINDy draws from numpy's global generator
        ensemble = pysindy.EnsembleOptimizer(
            pysindy.STLSQ(threshold=threshold, alpha=_RIDGE), bagging=True, n_models=_MODELS
        )
        ensemble.fit(X, Y)
    held = np.abs(np.array(ensemble.coef_list)) > 0.0  # (models, c, terms)
    share: Array = held.mean(axis=0).T
    return share


def _best_threshold(problem: Problem) -> float:
    """The threshold whose terms predict trajectories left out best."""
    trajectory = np.array([r.trajectory for r in problem.case.fitted])[problem.block.astype(int)]
    left_out = np.unique(trajectory)
    if len(left_out) < 2:
        return _THRESHOLDS[2]
    costs = []
    for threshold in _THRESHOLDS:
        cost = 0.0
        for one in left_out:
            inside = trajectory != one
            chosen = _ensemble(problem.X[inside], problem.Y[inside], threshold) >= _INCLUDED
            part = Problem(
                problem.case, problem.terms, problem.scale, problem.X[inside], problem.Y[inside], problem.block[inside]
            )  # fmt: skip
            left = problem.Y[~inside] - problem.X[~inside] @ _refitted(part, chosen)
            cost += float(np.sum(left**2))
        costs.append(cost)
    return _THRESHOLDS[int(np.argmin(costs))]


def _refitted(problem: Problem, chosen: Array) -> Array:
    """Least squares of each channel on the terms chosen for it."""
    coefficients = np.zeros((len(problem.terms), problem.Y.shape[1]))
    for channel in range(problem.Y.shape[1]):
        columns = np.flatnonzero(chosen[:, channel])
        if len(columns):
            coefficients[columns, channel] = least_squares(problem.X[:, columns], problem.Y[:, [channel]])[:, 0]
    return coefficients
