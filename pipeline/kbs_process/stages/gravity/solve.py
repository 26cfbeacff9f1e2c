"""The gravity equation solved for the rig and every recording's zero at once, with the weights it takes.

A recording's zero is a constant (its taring) and a slow drift: the first and second Legendre polynomial over its
length, which hold a transducer's warming up. The constant has the prior that the rig file gives the bias. Drift has
one of its own, which grows with time: from end to end, the rms noise of a sample for every minute, and no more than
the bias. A channel whose bias is exact has neither. Drift is thus told from gravity where the motion repeats; where it
does not, it widens the parameters' uncertainty.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.polynomial.legendre import legvander

from kbs_process.errors import FitError
from kbs_process.estimation.fit import Fit, Parameters, combination, fit_map
from kbs_process.estimation.flicker import flicker_scores
from kbs_process.estimation.longrun import variance_inflation
from kbs_process.estimation.tensors import Tensors
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array
from kbs_process.stages.gravity.angles import rounding_scores
from kbs_process.stages.gravity.equation import Equation, Prepared, joined
from kbs_process.stages.gravity.parameters import Index

ZERO = ("bias", "drift", "drift curvature")
_TERMS = len(ZERO)
DRIFT_S = 60.0  # in which a zero drifts by the noise of a sample, one sigma


def solve(
    equation: Equation, prepared: Sequence[Prepared], sigmas: Sequence[Array], theta: Array, low_pass_Hz: float
) -> Fit:
    c, size = len(equation.channels), equation.size
    loose = _loose(equation)
    width = _TERMS * len(loose)  # zeros of a recording
    bases = [zero_basis(p) for p in prepared]
    every, ends = joined(prepared), np.cumsum([len(p.q) for p in prepared])[:-1]

    def drifting(full: Array) -> Array:
        return _zeros(full[size:], len(prepared), equation)

    def residual(full: Array) -> Array:
        predicted = np.split(equation.predict(full[:size], every), ends)
        parts = [
            (own + basis @ zero - p.wrench) / sigma
            for own, p, basis, zero, sigma in zip(predicted, prepared, bases, drifting(full), sigmas, strict=True)
        ]
        return np.concatenate([part.ravel() for part in parts])

    def jacobian(full: Array) -> Array:
        blocks = []
        slopes = np.split(equation.jacobian(full[:size], every).reshape(len(every.q), c, size), ends)
        for index, (p, own, basis, sigma) in enumerate(zip(prepared, slopes, bases, sigmas, strict=True)):
            block = np.zeros((len(p.q), c, len(full)))
            block[:, :, :size] = own
            at = size + index * width
            block[:, :, at : at + width] = np.einsum("nk,cd->nckd", basis, np.eye(c)[:, loose]).reshape(
                len(p.q), c, width
            )
            blocks.append((block / sigma[:, None]).reshape(len(p.q) * c, -1))
        return np.concatenate(blocks)

    series = [(len(p.q), c) for p in prepared]
    intervals = [float(np.median(np.diff(p.t))) for p in prepared]

    def scores(r: Array, J: Array) -> Array:
        noise = flicker_scores(r, J, series, intervals, low_pass_Hz)
        return noise + rounding_scores(equation, theta, prepared, sigmas, J)

    names = tuple(f"{term}[{p.name}].{equation.channels[index]}" for p in prepared for term in ZERO for index in loose)
    parameters = Parameters(
        names=equation.names + names,
        value=np.concatenate([equation.start(), np.zeros(len(names))]),
        sigma=np.concatenate([equation.sigma(), *(zero_sigma(equation, p)[:, loose].ravel() for p in prepared)]),
        lower=np.concatenate([equation.lower(), np.full(len(names), -np.inf)]),
        tensors=Tensors.among(equation.names, equation.elements.rig.inertias),
    )
    first = [
        np.linalg.lstsq(basis, (p.wrench - equation.predict(theta, p))[:, loose])[0].ravel()
        for p, basis in zip(prepared, bases, strict=True)
    ]
    return fit_map(
        residual, parameters, jacobian=jacobian, series=series, scores=scores, start=np.concatenate([theta, *first])
    )


def zeros(equation: Equation, fit: Fit, recordings: int) -> Array:
    """Fitted coefficients of each recording's zero: (recordings, terms, c), the constant first."""
    return _zeros(fit.value[equation.size :], recordings, equation)


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


def _without_zero(values: Array, p: Prepared) -> Array:
    """Take constant and drift, by least squares, off values (n, ...)."""
    basis = zero_basis(p)
    flat = values.reshape(len(values), -1)
    left: Array = flat - basis @ np.linalg.lstsq(basis, flat)[0]
    return left.reshape(values.shape)


def first_sigma(p: Prepared, rig: Rig) -> Array:
    """Before there is a residual: a hundredth of the range that the channel shows, the sensor's noise at least.

    Channels that hold nothing but noise would bend all parameters to it otherwise, far from where the equation is
    nearly linear.
    """
    sigma: Array = np.maximum(0.01 * np.ptp(p.wrench, axis=0), 10.0 * least_sigma(p, rig))
    return sigma


def residual_sigma(equation: Equation, theta: Array, p: Prepared, rig: Rig) -> Array:
    """Standard deviation (c,) of white noise that would leave the parameters as uncertain as this residual."""
    residual = _without_zero(p.wrench - equation.predict(theta, p), p)
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
    blocks = []
    for p in prepared:
        J = equation.jacobian(equation.start(), p).reshape(len(p.q), len(equation.channels), -1)
        blocks.append(
            (_without_zero(J, p) / (10.0 * least_sigma(p, equation.elements.rig))[:, None]).reshape(-1, equation.size)
        )
    _, s, Vt = np.linalg.svd(np.concatenate(blocks) * equation.sigma(), full_matrices=False)
    if s[0] < 1.0:
        direction = combination(Vt[0], equation.names)
        raise FitError(
            "the recordings say less about the rig than its parameter files do; the best that they hold, "
            f"{direction} (in prior sigmas), cannot be told apart from the zeros of the readings",
            remedy="add a recording that turns the joints further",
        )
