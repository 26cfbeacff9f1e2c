"""The gravity equation solved for the rig and every recording's zero at once, with the weights it takes.

A recording's zero is a constant (its taring) and a slow drift: the first and second Legendre polynomial over its
length, which hold a transducer's warming up. The constant has the prior that the rig file gives the bias. Drift has
one of its own, which grows with time: from end to end, the rms noise of a sample for every minute, and no more than
the bias. A channel whose bias is exact has neither. Drift is thus told from gravity where the motion repeats; where it
does not, it widens the parameters' uncertainty.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legvander

from kbs_process.errors import FitError
from kbs_process.estimation.fit import Fit, Found, Parameters, Problem, combination, minimise, stated
from kbs_process.estimation.flicker import flicker_scores
from kbs_process.estimation.longrun import longrun_covariance, variance_inflation
from kbs_process.estimation.tensors import Tensors
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array
from kbs_process.stages.gravity.angles import Rounding
from kbs_process.stages.gravity.equation import Equation, Prepared, blocks, joined
from kbs_process.stages.gravity.parameters import Index

ZERO = ("bias", "drift", "drift curvature")
_TERMS = len(ZERO)
DRIFT_S = 60.0  # in which a zero drifts by the noise of a sample, one sigma


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """The rig's parameters that fit all recordings, each channel weighed by its sigma, and the recordings' zeros."""

    equation: Equation
    prepared: Sequence[Prepared]
    sigmas: Sequence[Array]  # (c,) of each recording
    parameters: Parameters
    problem: Problem
    found: Found

    @property
    def theta(self) -> Array:
        """The rig's parameters alone."""
        return self.found.theta[: self.equation.size]

    @property
    def zeros(self) -> Array:
        """Coefficients of each recording's zero: (recordings, terms, c), the constant first."""
        return _zeros(self.found.theta[self.equation.size :], len(self.prepared), self.equation)

    def stated(self, low_pass_Hz: float) -> Fit:
        """The fit with its uncertainty: residuals of any colour, 1/f noise below `low_pass_Hz`, encoder rounding."""
        equation, count = self.equation, len(self.found.theta)
        loose, c = _loose(equation), len(equation.channels)
        longrun, modelled = np.zeros((count, count)), np.zeros((count, count))
        rounding = Rounding(equation, self.theta, count)
        for index, (p, sigma, zero) in enumerate(zip(self.prepared, self.sigmas, self.zeros, strict=True)):
            basis = zero_basis(p)
            terms = np.einsum("nk,cd->nckd", basis, np.eye(c)[:, loose]).reshape(len(p.q), c, -1)
            slopes = equation.jacobian(self.theta, p).reshape(len(p.q), c, -1)
            J = np.concatenate([slopes, terms], axis=2) / sigma[:, None]
            r = (equation.predict(self.theta, p) + basis @ zero - p.wrench) / sigma
            width = terms.shape[2]
            at = np.r_[: equation.size, equation.size + index * width : equation.size + (index + 1) * width]
            own = np.ix_(at, at)
            longrun[own] += longrun_covariance(np.einsum("nc,ncp->np", r, J), [(len(r), 1)])
            flat, interval = J.reshape(r.size, -1), float(np.median(np.diff(p.t)))
            modelled[own] += flicker_scores(r.ravel(), flat, [r.shape], [interval], low_pass_Hz)
            rounding.add(p, sigma, J, at)
        return stated(self.problem, self.parameters, self.found, [longrun, modelled + rounding.scores()])


def solve(equation: Equation, prepared: Sequence[Prepared], sigmas: Sequence[Array], theta: Array) -> Solution:
    """Solve from `theta` on; of a recording's rows triangles are kept, a few for each channel."""
    size, loose = equation.size, _loose(equation)
    every, ends = joined(prepared), np.cumsum([len(p.q) for p in prepared])[:-1]
    bases = [zero_basis(p) for p in prepared]

    def residuals(theta: Array) -> list[Array]:
        return np.split(np.concatenate([equation.predict(theta, part) for part in blocks(every)]) - every.wrench, ends)

    def cost(full: Array) -> float:
        each = zip(residuals(full[:size]), bases, _zeros(full[size:], len(prepared), equation), sigmas, strict=True)
        return float(sum(np.sum(((left + basis @ zero) / sigma) ** 2) for left, basis, zero, sigma in each))

    def triangle(full: Array) -> Array:
        T = triangles(equation, full[:size], prepared) / np.stack(sigmas)[:, :, None, None]
        rows = np.zeros((*T.shape[:3], len(full) + 1))
        rows[..., :size] = T[..., _TERMS:-1]
        zero = np.swapaxes(_zeros(full[size:], len(prepared), equation), 1, 2)
        rows[..., -1] = T[..., -1] + np.einsum("rckt,rct->rck", T[..., :_TERMS], zero)
        for index, (place, channel) in itertools.product(range(len(prepared)), enumerate(loose)):
            at = size + (index * _TERMS + np.arange(_TERMS)) * len(loose) + place
            rows[index, channel][:, at] = T[index, channel, :, :_TERMS]
        return rows.reshape(-1, len(full) + 1)

    names = tuple(f"{term}[{p.name}].{equation.channels[index]}" for p in prepared for term in ZERO for index in loose)
    parameters = Parameters(
        names=equation.names + names,
        value=np.concatenate([equation.start(), np.zeros(len(names))]),
        sigma=np.concatenate([equation.sigma(), *(zero_sigma(equation, p)[:, loose].ravel() for p in prepared)]),
        lower=np.concatenate([equation.lower(), np.full(len(names), -np.inf)]),
        tensors=Tensors.among(equation.names, equation.elements.rig.inertias),
    )
    first = [
        np.linalg.lstsq(basis, -left[:, loose])[0].ravel() for left, basis in zip(residuals(theta), bases, strict=True)
    ]
    problem = Problem(cost, triangle, every.wrench.size)
    found = minimise(problem, parameters, np.concatenate([theta, *first]))
    return Solution(equation, prepared, sigmas, parameters, problem, found)


def triangles(equation: Equation, theta: Array, prepared: Sequence[Prepared]) -> Array:
    """T (recordings, c, k, k) of T'T = A'A, rows of A: a zero's terms, the slopes, what is predicted less measured.

    A has a row for each instant of a channel; a block of them is in memory at a time.
    """
    every, c = joined(prepared), len(equation.channels)
    bases = np.concatenate([zero_basis(p) for p in prepared])
    A = np.empty((0, c, _TERMS + equation.size + 1))
    T = np.zeros((len(prepared), c, A.shape[2], A.shape[2]))
    whose, start = np.repeat(np.arange(len(prepared)), [len(p.q) for p in prepared]), 0
    for part in blocks(every):
        rows = slice(start, start := start + len(part.q))
        A = np.empty((len(part.q), *A.shape[1:]))
        A[..., :_TERMS] = bases[rows, None]
        A[..., _TERMS:-1] = equation.jacobian(theta, part).reshape(len(A), c, -1)
        A[..., -1] = equation.predict(theta, part) - part.wrench
        for index in np.unique(whose[rows]):
            own = np.swapaxes(A[whose[rows] == index], 0, 1)
            T[index] = np.linalg.qr(np.concatenate([T[index], own], axis=1), mode="r")
    return T


def _zeros(values: Array, recordings: int, equation: Equation) -> Array:
    loose = _loose(equation)
    every = np.zeros((recordings, _TERMS, len(equation.channels)))
    every[:, :, loose] = values.reshape(recordings, _TERMS, len(loose))
    return every


def zero_sigma(equation: Equation, p: Prepared) -> Array:
    """Priors (terms, c) of a recording's zero: the constant's, and of what drifts half of it from end to end."""
    rig = equation.elements.rig
    noise = rig.loads.noise[rig.loads.index(rig.channels)]
    across = np.minimum(noise * (p.t[-1] - p.t[0]) / DRIFT_S, equation.bias_sigma)
    drift = np.maximum(0.5 * across, 1e-9 * equation.bias_sigma)
    return np.stack([equation.bias_sigma, drift, drift])


def _loose(equation: Equation) -> Index:
    """The channels whose zero is not exact."""
    return np.flatnonzero(equation.bias_sigma > 0.0)


def zero_basis(p: Prepared) -> Array:
    """Legendre polynomials (n, terms) of order 0, 1, ... over the recording's instants."""
    x = 2.0 * (p.t - p.t[0]) / (p.t[-1] - p.t[0]) - 1.0
    basis: Array = legvander(x, _TERMS - 1)
    return basis


def first_sigma(p: Prepared, rig: Rig) -> Array:
    """Before there is a residual: a hundredth of the range that the channel shows, the sensor's noise at least.

    Channels that hold nothing but noise would bend all parameters to it otherwise, far from where the equation is
    nearly linear.
    """
    sigma: Array = np.maximum(0.01 * np.ptp(p.wrench, axis=0), 10.0 * least_sigma(p, rig))
    return sigma


def residual_sigma(equation: Equation, theta: Array, p: Prepared, rig: Rig) -> Array:
    """Standard deviation (c,) of white noise that would leave the parameters as uncertain as this residual."""
    residual, basis = p.wrench - equation.predict(theta, p), zero_basis(p)
    residual -= basis @ np.linalg.lstsq(basis, residual)[0]
    coloured = np.sqrt(np.mean(residual**2, axis=0) * variance_inflation(residual))
    sigma: Array = np.maximum(coloured, least_sigma(p, rig))
    return sigma


def least_sigma(p: Prepared, rig: Rig) -> Array:
    noise = rig.loads.noise[rig.loads.index(rig.channels)]
    floor: Array = np.maximum(0.1 * noise, 1e-9 * (1.0 + np.ptp(p.wrench, axis=0)))
    return floor


def refuse_uninformed(equation: Equation, prepared: Sequence[Prepared]) -> None:
    """Refuse data whose strongest message about the rig, zero and drift aside, is weaker than the prior.

    What they could say is asked, with the sensor's noise alone: what else is in them is no reason to move more.
    """
    if equation.size == 0:
        return  # the files know the rig exactly
    least = 10.0 * np.stack([least_sigma(p, equation.elements.rig) for p in prepared])
    apart = triangles(equation, equation.start(), prepared)[:, :, _TERMS:, _TERMS:-1] / least[:, :, None, None]
    _, s, Vt = np.linalg.svd(apart.reshape(-1, equation.size) * equation.sigma(), full_matrices=False)
    if s[0] < 1.0:
        direction = combination(Vt[0], equation.names)
        raise FitError(
            "the recordings say less about the rig than its parameter files do; the best that they hold, "
            f"{direction} (in prior sigmas), cannot be told apart from the zeros of the readings",
            remedy="add a recording that turns the joints further",
        )
