"""Taring: the constant that the transducer adds to a recording, a different one to each.

The constants of the fitted recordings are parameters of the gravity fit. Any other recording has its own estimated
with the model held: the location of what the model leaves, by maximum likelihood under Student's t with four degrees
of freedom about the spread that the fitted recordings have. Time under a load that the model does not hold (a hand, a
cable at its stop) then weighs little, where a mean would take that load for bias. The rig file's prior is the fit's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kbs_process.estimation.longrun import longrun_covariance
from kbs_process.signals.records import Array
from kbs_process.stages.gravity.equation import Equation, Prepared

_FREEDOM = 4.0  # degrees of Student's t: 5 % less efficient than the mean on normal noise
_STARTS = np.linspace(0.05, 0.95, 19)  # quantiles: the likelihood of a loaded recording has several maxima
_ROUNDS = 40  # of reweighting; each takes a third of the error off


@dataclass(frozen=True, slots=True, eq=False)
class Taring:
    """A recording's constant. It errs by slope @ (error of the rig's parameters), and by `noise` independently."""

    bias: Array  # (c,) N and N m
    slope: Array  # (c, p)
    noise: Array  # (c,) N and N m
    fitted: bool  # together with the rig, or after it

    @staticmethod
    def none(channels: int, parameters: int) -> Taring:
        """The rig's own wrench, nothing added."""
        return Taring(np.zeros(channels), np.zeros((channels, parameters)), np.zeros(channels), fitted=False)


def of_fit(equation: Equation, slope: Array, p: Prepared, bias: Array, sigma: Array) -> Taring:
    """The constant that the fit found for one of its recordings, whose samples it weighed by `sigma` (c,).

    `slope` (c, p) is the mean derivative over its instants. Given the rig's parameters the constant is the mean of
    what the model leaves, shrunk by its prior, and errs as that does.
    """
    variance = sigma**2 / len(p.q)
    shrink = _shrink(equation.bias_sigma, variance)
    return Taring(bias, -shrink[:, None] * slope, np.sqrt(shrink * variance), fitted=True)


def estimate(equation: Equation, theta: Array, p: Prepared, spread: Array) -> Taring:
    """Estimate the constant of a recording that was not fitted; `spread` (c,) is that of the fitted ones' residual."""
    residual = p.wrench - equation.predict(theta, p)
    located = [locate(x, float(scale)) for x, scale in zip(residual.T, spread, strict=True)]
    location = np.array([at for at, _, _ in located])
    variance = np.array([error for _, error, _ in located])
    weight = np.stack([w / w.sum() for _, _, w in located], axis=1)
    shrink = _shrink(equation.bias_sigma, variance)
    J = equation.jacobian(theta, p).reshape(*residual.shape, equation.size)
    mean = np.einsum("nc,nci->ci", weight, J)
    return Taring(shrink * location, -shrink[:, None] * mean, np.sqrt(shrink * variance), fitted=False)


def _shrink(prior: Array, variance: Array) -> Array:
    """Part (c,) of an estimate of this variance that a zero-mean prior of standard deviation `prior` lets stand."""
    part: Array = prior**2 / np.maximum(prior**2 + variance, 1e-300)
    return part


def locate(x: Array, scale: float) -> tuple[float, float, Array]:
    """Location of correlated samples x (n,) under Student's t of `scale`, its variance, and the weights (n,) used.

    Iteratively reweighted from several starts, the likeliest taken. Variance: long-run variance of the scores over
    the squared curvature of the likelihood (sandwich), and the samples' range squared at most: where all samples lie
    farther than `scale` from the location, the likelihood has no such curvature.
    """
    location = np.quantile(x, _STARTS)
    for _ in range(_ROUNDS):
        weight = _weight((x - location[:, None]) / scale)
        location = np.sum(weight * x, axis=1) / np.sum(weight, axis=1)
    z = (x - location[:, None]) / scale
    best = int(np.argmin(np.sum(np.log1p(z**2 / _FREEDOM), axis=1)))
    z = z[best]
    weight = _weight(z)
    curvature = float(np.sum(weight * (_FREEDOM - z**2) / (_FREEDOM + z**2))) / scale
    scores = weight * z
    spread, most = float(longrun_covariance(scores[:, None])[0, 0]), float(np.ptp(x)) ** 2
    told = curvature > 0.0 and spread < most * curvature**2
    return float(location[best]), spread / curvature**2 if told else most, weight


def _weight(z: Array) -> Array:
    weight: Array = (_FREEDOM + 1.0) / (_FREEDOM + z**2)
    return weight
