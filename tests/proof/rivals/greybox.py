"""Stepwise grey box: the group of terms that gains most enters, while it is significant and improves prediction.

Effort: generalised least squares (each channel prewhitened by an autoregression of order 4 of what the whole library
leaves of it), an F-test of each group over all channels with Bonferroni's correction at
0.001, at most six groups, and a group enters only if it improves the prediction of trajectories left out of the fit
(Kristensen, Madsen & Jorgensen, Automatica 40, 2004; Ljung, System Identification, 1999, chapter 16).
"""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter
from scipy.stats import f as f_distribution

from proof.answer import Answer
from proof.rivals.case import Array, Case
from proof.rivals.regress import Group, Problem, answer, least_squares

_ORDER = 4
_LEVEL = 1e-3
_MOST = 6


def solve(case: Case) -> Answer:
    """Return the answer of the stepwise search."""
    begin = monotonic()
    problem = Problem.of(case)
    chosen: list[Group] = []
    first_p = 0.0
    coefficients = np.zeros((len(problem.terms), problem.Y.shape[1]))
    noise = problem.Y - problem.X @ least_squares(problem.X, problem.Y)
    while len(chosen) < _MOST:
        group, log10_p = _best(problem, chosen, noise)
        if not chosen:
            first_p = log10_p
        if log10_p > np.log10(_LEVEL):
            break
        if _left_out(problem, [*chosen, group]) >= _left_out(problem, chosen):
            break
        chosen.append(group)
        coefficients = _fitted(problem, chosen)
    return answer("grey box", problem, coefficients, log10_p=first_p, seconds=monotonic() - begin)


def _fitted(problem: Problem, groups: list[Group]) -> Array:
    coefficients = np.zeros((len(problem.terms), problem.Y.shape[1]))
    columns = problem.columns(groups)
    coefficients[columns] = least_squares(problem.X[:, columns], problem.Y)
    return coefficients


def _best(problem: Problem, chosen: list[Group], noise: Array) -> tuple[Group, float]:
    """The group with the smallest p-value beside those chosen, corrected for the number of groups."""
    others = [group for group in problem.groups if group not in chosen]
    statistic = dict.fromkeys(others, 0.0)
    freedom = dict.fromkeys(others, (0, 0))
    had = problem.columns(chosen)
    for channel in range(noise.shape[1]):
        whiten = _prewhitener(noise[:, channel], problem.block)
        y = whiten(problem.Y[:, [channel]])
        X = whiten(problem.X)
        base = np.linalg.qr(X[:, had])[0] if had else np.zeros((len(X), 0))
        y = y - base @ (base.T @ y)
        X = X - base @ (base.T @ X)
        for group in others:
            columns = problem.columns([group])
            Q, R = np.linalg.qr(X[:, columns])
            Q = Q[:, np.abs(np.diag(R)) > 1e-6 * np.sqrt(len(X))]
            gain = float(np.sum((Q.T @ y) ** 2))
            rest = float(np.sum(y**2)) - gain
            free = len(X) - len(had) - Q.shape[1]
            statistic[group] += gain / max(rest / free, 1e-300)
            freedom[group] = (freedom[group][0] + Q.shape[1], freedom[group][1] + free)
    p = {
        group: f_distribution.logsf(statistic[group] / max(a, 1), max(a, 1), b) / np.log(10.0)
        for group, (a, b) in freedom.items()
    }
    best = min(p, key=lambda group: (p[group], -statistic[group]))
    return best, min(0.0, float(p[best]) + float(np.log10(len(problem.groups))))


def _prewhitener(noise: Array, block: Array) -> Callable[[Array], Array]:
    """Filter that turns an autoregression like `noise`'s into white noise, recording by recording."""
    r = np.array([np.mean(noise[: len(noise) - k] * noise[k:]) for k in range(_ORDER + 1)])
    a = solve_toeplitz(r[:-1] * np.r_[1.0 + 1e-6, np.ones(_ORDER - 1)], r[1:])
    taps = np.concatenate([[1.0], -a])
    edges = np.flatnonzero(np.diff(block)) + 1

    def whiten(columns: Array) -> Array:
        return np.concatenate([lfilter(taps, 1.0, part, axis=0)[_ORDER:] for part in np.split(columns, edges)])

    return whiten


def _left_out(problem: Problem, groups: list[Group]) -> float:
    """Squared error of each trajectory predicted by the others; with one trajectory, of what is fitted."""
    trajectory = np.array([r.trajectory for r in problem.case.fitted])[problem.block.astype(int)]
    columns = problem.columns(groups)
    cost = 0.0
    for one in np.unique(trajectory):
        outside = trajectory == one
        inside = ~outside if not outside.all() else outside
        fitted = least_squares(problem.X[np.ix_(inside, columns)], problem.Y[inside])
        cost += float(np.sum((problem.Y[outside] - problem.X[np.ix_(outside, columns)] @ fitted) ** 2))
    return cost
