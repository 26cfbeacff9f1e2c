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
from kbs_process.estimation.fit import MAX_ITERATIONS, Check, Fit, Parameters, Problem, combination, minimise, stated
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


class Rows:
    """The equation at all instants of some recordings, a block of which is in memory at a time."""

    def __init__(self, equation: Equation, prepared: Sequence[Prepared]) -> None:
        self.equation, self.prepared = equation, prepared
        self._every, self._whose = joined(prepared), np.repeat(np.arange(len(prepared)), [len(p.q) for p in prepared])
        self._last: tuple[Array, Array] | None = None

    def residuals(self, theta: Array) -> list[Array]:
        """What is predicted less what is measured, (n, c) of each recording."""
        left = [self.equation.predict(theta, part) - part.wrench for part in blocks(self._every)]
        return np.split(np.concatenate(left), np.flatnonzero(np.diff(self._whose)) + 1)

    def triangles(self, theta: Array) -> Array:
        """T (recordings, c, k, k) of T'T = A'A, rows of A: a zero's terms, slopes, what is predicted less measured."""
        if self._last is not None and np.array_equal(self._last[0], theta):
            return self._last[1]
        c, width = len(self.equation.channels), _TERMS + self.equation.size + 1
        bases = np.concatenate([zero_basis(p) for p in self.prepared])
        T, start = np.zeros((len(self.prepared), c, width, width)), 0
        for part in blocks(self._every):
            rows = slice(start, start := start + len(part.q))
            left = self.equation.predict(theta, part) - part.wrench
            zero = np.broadcast_to(bases[rows, None], (*left.shape, _TERMS))
            slopes = self.equation.jacobian(theta, part).reshape(*left.shape, -1)
            A = np.concatenate([zero, slopes, left[..., None]], axis=2)
            for index in np.unique(self._whose[rows]):
                own = np.swapaxes(A[self._whose[rows] == index], 0, 1)
                T[index] = np.linalg.qr(np.concatenate([T[index], own], axis=1), mode="r")
        self._last = theta.copy(), T
        return T

    def mean_slopes(self, theta: Array) -> Array:
        """Slopes (recordings, c, p), each the mean over a recording: the first term of a zero is 1."""
        T = self.triangles(theta)
        counts = np.bincount(self._whose)
        mean: Array = np.einsum("rck,rckp->rcp", T[..., 0], T[..., _TERMS:-1]) / counts[:, None, None]
        return mean


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """The rig's parameters that fit all recordings, each channel weighed by its sigma, and the recordings' zeros."""

    rows: Rows
    sigmas: Sequence[Array]  # (c,) of each recording
    parameters: Parameters
    problem: Problem
    every: Array  # number
    converged: Check

    @property
    def theta(self) -> Array:
        """The rig's parameters alone."""
        return self.every[: self.rows.equation.size]

    @property
    def zeros(self) -> Array:
        """Coefficients of each recording's zero: (recordings, terms, c), the constant first."""
        return _zeros(self.every[len(self.theta) :], len(self.sigmas), self.rows.equation)

    def stated(self, low_pass_Hz: float) -> Fit:
        """The fit with its uncertainty: residuals of any colour, 1/f noise below `low_pass_Hz`, encoder rounding."""
        equation, count, c = self.rows.equation, len(self.every), len(self.rows.equation.channels)
        longrun, modelled = np.zeros((count, count)), np.zeros((count, count))
        rounding = Rounding(equation, self.theta, count)
        for index, (p, sigma, zero) in enumerate(zip(self.rows.prepared, self.sigmas, self.zeros, strict=True)):
            terms = zero_slopes(equation, p)
            slopes = equation.jacobian(self.theta, p).reshape(len(p.q), c, -1)
            J = np.concatenate([slopes, terms], axis=2) / sigma[:, None]
            r = (equation.predict(self.theta, p) + zero_basis(p) @ zero - p.wrench) / sigma
            width = terms.shape[2]
            at = np.r_[: equation.size, equation.size + index * width : equation.size + (index + 1) * width]
            own = np.ix_(at, at)
            longrun[own] += longrun_covariance(np.einsum("nc,ncp->np", r, J))
            modelled[own] += flicker_scores(r, J, float(np.median(np.diff(p.t))), low_pass_Hz)
            rounding.add(p, sigma, J, at)
        scores = [longrun, modelled + rounding.scores()]
        return stated(self.problem, self.parameters, self.every, self.converged, scores)


def solve(rows: Rows, sigmas: Sequence[Array], theta: Array, most: int = MAX_ITERATIONS) -> Solution:
    """Solve from `theta` on, by `most` steps."""
    equation, prepared = rows.equation, rows.prepared
    size, loose = equation.size, _loose(equation)
    bases, known = [zero_basis(p) for p in prepared], [zero_sigma(equation, p)[:, loose].T for p in prepared]

    def with_zeros(theta: Array) -> Array:
        """These parameters of the rig, and the zeros that fit best with them."""
        best = []
        for left, basis, sigma, prior in zip(rows.residuals(theta), bases, sigmas, known, strict=True):
            weight = sigma[loose, None] ** -2
            H = weight[:, None] * (basis.T @ basis) + np.eye(_TERMS) * prior[:, None] ** -2
            best.append(np.linalg.solve(H, (weight * -(basis.T @ left[:, loose]).T)[..., None])[..., 0].T.ravel())
        return np.concatenate([theta, *best])

    def cost(full: Array) -> float:
        zeros = _zeros(full[size:], len(prepared), equation)
        each = zip(rows.residuals(full[:size]), bases, zeros, sigmas, strict=True)
        return float(sum(np.sum(((left + basis @ zero) / sigma) ** 2) for left, basis, zero, sigma in each))

    def triangle(full: Array) -> Array:
        T = rows.triangles(full[:size]) / np.stack(sigmas)[:, :, None, None]
        whole = np.zeros((*T.shape[:3], len(full) + 1))
        whole[..., :size] = T[..., _TERMS:-1]
        zeros = np.swapaxes(_zeros(full[size:], len(prepared), equation), 1, 2)
        whole[..., -1] = T[..., -1] + np.einsum("rckt,rct->rck", T[..., :_TERMS], zeros)
        for index, (place, channel) in itertools.product(range(len(prepared)), enumerate(loose)):
            at = size + (index * _TERMS + np.arange(_TERMS)) * len(loose) + place
            whole[index, channel][:, at] = T[index, channel, :, :_TERMS]
        return whole.reshape(-1, len(full) + 1)

    names, sigma = zero_priors(equation, prepared)
    parameters = Parameters(
        names=equation.names + names,
        value=np.concatenate([equation.start(), np.zeros(len(names))]),
        sigma=np.concatenate([equation.sigma(), sigma]),
        lower=np.concatenate([equation.lower(), np.full(len(names), -np.inf)]),
        tensors=Tensors.among(equation.names, equation.elements.rig.inertias),
    )
    samples = sum(p.wrench.size for p in prepared)
    problem = Problem(cost, triangle, samples, lambda full, to: with_zeros(equation.bent(full[:size], to[:size])))
    return Solution(rows, sigmas, parameters, problem, *minimise(problem, parameters, with_zeros(theta), most))


def zero_priors(equation: Equation, prepared: Sequence[Prepared]) -> tuple[tuple[str, ...], Array]:
    """Names and sigmas of all recordings' zeros, in the order of `zero_slopes`."""
    loose = _loose(equation)
    names = tuple(f"{term}[{p.name}].{equation.channels[index]}" for p in prepared for term in ZERO for index in loose)
    return names, np.concatenate([zero_sigma(equation, p)[:, loose].ravel() for p in prepared])


def zero_slopes(equation: Equation, p: Prepared) -> Array:
    """Derivatives (n, c, k) by the numbers of a recording's zero."""
    own = np.eye(len(equation.channels))[:, _loose(equation)]
    slopes: Array = np.einsum("nk,cd->nckd", zero_basis(p), own).reshape(len(p.q), len(own), -1)
    return slopes


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


def refuse_uninformed(rows: Rows) -> None:
    """Refuse data whose strongest message about the rig, zero and drift aside, is weaker than the prior.

    What they could say is asked, with the sensor's noise alone: what else is in them is no reason to move more.
    """
    equation = rows.equation
    if equation.size == 0:
        return  # the files know the rig exactly
    least = 10.0 * np.stack([least_sigma(p, equation.elements.rig) for p in rows.prepared])
    apart = rows.triangles(equation.start())[:, :, _TERMS:, _TERMS:-1] / least[:, :, None, None]
    _, s, Vt = np.linalg.svd(apart.reshape(-1, equation.size) * equation.sigma(), full_matrices=False)
    if s[0] < 1.0:
        direction = combination(Vt[0], equation.names)
        raise FitError(
            "the recordings say less about the rig than its parameter files do: zeros of the readings hide even what "
            f"they show best, which is {direction} (each in its prior sigmas)",
            remedy="add a recording that turns the joints further, or lasts longer",
        )
