"""Maximum a posteriori least squares: Levenberg-Marquardt on whitened residuals with Gaussian priors.

theta = argmin |r(theta)|^2 + sum(((theta - theta_0) / sigma_0)^2), r whitened by the caller. The covariance is the
greater of the model's H^-1 (right where residuals are white with unit variance) and the sandwiches H^-1 (S + P) H^-1,
with S covariances of the scores J^T r for residuals of any colour.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.linalg import lstsq

from kbs_process.errors import FitError
from kbs_process.estimation.tensors import Tensors
from kbs_process.signals.records import Array

Residual = Callable[[Array], Array]
MAX_ITERATIONS = 60
_LARGEST_DAMPING = 1e12
_PROMISE = 1e-8  # of the cost, where 1 is a sigma: a step that promises less is not taken, and ends the search
_SINGULAR = 1e-11  # of the greatest singular value, columns scaled to unit length
_WEAK = 0.9  # posterior over prior sigma from which the data say little
_CONFUSED = 0.98  # correlation
_SEEN = 0.5  # prior sigmas over noise: what a parameter alone would show in the data


@dataclass(frozen=True, slots=True, eq=False)
class Parameters:
    """What is fitted: start values that are also the prior's mean, and its sigma (inf: no prior)."""

    names: tuple[str, ...]
    value: Array  # (p,)
    sigma: Array  # (p,) > 0
    lower: Array = field(default_factory=lambda: np.array(-np.inf))  # (p,), or one for all
    upper: Array = field(default_factory=lambda: np.array(np.inf))
    tensors: Tensors | None = None  # of bodies' inertia, among them

    def __post_init__(self) -> None:
        for side in ("lower", "upper"):
            object.__setattr__(self, side, np.broadcast_to(getattr(self, side), self.value.shape))

    @property
    def scale(self) -> Array:
        """A step of each parameter that matters: its prior sigma, else its size, else 1."""
        size = np.where(self.value != 0.0, np.abs(self.value), 1.0)
        scale: Array = np.where(np.isfinite(self.sigma), self.sigma, size)
        return scale

    def clipped(self, theta: Array) -> Array:
        """The nearest numbers (p,) within bounds, which are those of bodies."""
        near = np.asarray(np.clip(theta, self.lower, self.upper), dtype=np.float64)
        return near if self.tensors is None else self.tensors.bodily(near)

    def stuck(self, theta: Array) -> list[str]:
        """Names of those that are at a bound."""
        edge = set[int]() if self.tensors is None else self.tensors.at_edge(theta)
        beyond = (theta <= self.lower) | (theta >= self.upper)
        return [name for place, name in enumerate(self.names) if beyond[place] or place in edge]

    def chosen(self, places: Sequence[int]) -> Parameters:
        """Those at some places alone."""
        return Parameters(
            tuple(self.names[i] for i in places),
            self.value[places],
            self.sigma[places],
            self.lower[places],
            self.upper[places],
            None if self.tensors is None else self.tensors.chosen(places),
        )

    def extended(
        self, names: Sequence[str], value: Array, sigma: Array, lower: Array | float, upper: Array | float
    ) -> Parameters:
        """These, and more of them."""
        more = np.broadcast_to(lower, value.shape), np.broadcast_to(upper, value.shape)
        return replace(
            self,
            names=(*self.names, *names),
            value=np.concatenate([self.value, value]),
            sigma=np.concatenate([self.sigma, sigma]),
            lower=np.concatenate([self.lower, more[0]]),
            upper=np.concatenate([self.upper, more[1]]),
        )


@dataclass(frozen=True, slots=True)
class Check:
    """One named question put to a fit, and its answer in words."""

    name: str
    passed: bool
    detail: str


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Estimates with their covariance; `checks` say what is wrong with them, if anything."""

    names: tuple[str, ...]
    value: Array  # (p,)
    sigma: Array  # (p,)
    covariance: Array  # (p, p)
    prior_sigma: Array  # (p,)
    checks: tuple[Check, ...]
    residual_rms: float  # of the whitened residual: 1 where the weights are right
    dof: int  # samples less parameters
    moved: Array  # (p,) estimate less the prior's mean
    moved_covariance: Array  # (p, p) of `moved`, where model and priors are right; infinite without a prior

    @property
    def ok(self) -> bool:
        return all(check.passed for check in self.checks)

    def __getitem__(self, name: str) -> float:
        return float(self.value[self.names.index(name)])


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """A whitened residual r (n,) that is never held as a whole."""

    cost: Callable[[Array], float]  # |r|^2
    triangle: Callable[[Array], Array]  # T (k, p + 1) of T'T = [J r]'[J r]
    samples: int
    bent: Callable[[Array, Array], Array] = lambda theta, reached: reached  # where a straight step should have led


def fit_map(
    residual: Residual,
    parameters: Parameters,
    *,
    jacobian: Callable[[Array], Array] | None = None,
    scores: Callable[[Array, Array], Array] | None = None,
    start: Array | None = None,
    iterations: int = MAX_ITERATIONS,
) -> Fit:
    """Fit `parameters` to a residual (n,) that is measured less modelled over its standard deviation.

    `scores` gives, from the residual and its Jacobian (n, p), the covariance (p, p) of J^T r by a model of the errors;
    without it they are taken as white. The search begins at `start`, or at the prior's mean, and ends after
    `iterations` at the latest. Raises FitError where data and prior leave a combination of parameters undetermined,
    and names it.
    """
    gradient = jacobian or (lambda theta: difference_jacobian(residual, theta, parameters.scale))
    begin = parameters.value if start is None else start
    problem = Problem(
        lambda theta: _cost(residual(theta)),
        lambda theta: triangle(np.column_stack([gradient(theta), residual(theta)])),
        len(residual(begin)),
    )
    theta, converged = minimise(problem, parameters, begin, iterations)
    covariances = [] if scores is None else [scores(residual(theta), gradient(theta))]
    return stated(problem, parameters, theta, converged, covariances)


def stated(problem: Problem, parameters: Parameters, theta: Array, converged: Check, scores: Sequence[Array]) -> Fit:
    """State what was found, its covariance no smaller than by each of `scores`, covariances (p, p) of J^T r."""
    T = problem.triangle(theta)
    precision = parameters.sigma**-2.0
    H_inverse = _inverse(T[:, :-1], precision, parameters)
    covariance = H_inverse
    for S in scores:
        covariance = _at_least(H_inverse @ (S + np.diag(precision)) @ H_inverse, covariance)
    sigma = np.sqrt(np.diag(covariance))
    # moved = (I - H^-1 P) d + H^-1 J^T e, d the prior's own error: (I - H^-1 P) P^-1 (I - P H^-1) + H^-1 S H^-1.
    moved_covariance = np.diag(parameters.sigma**2) - 2.0 * H_inverse + covariance
    identifiable = _identifiable_check(T[:, :-1], sigma, covariance, parameters)
    return Fit(
        names=parameters.names,
        value=theta,
        sigma=sigma,
        covariance=covariance,
        prior_sigma=parameters.sigma,
        checks=(converged, _bounds_check(theta, parameters), identifiable),
        residual_rms=float(np.sqrt(problem.cost(theta) / problem.samples)),
        dof=problem.samples - len(theta),
        moved=theta - parameters.value,
        moved_covariance=moved_covariance,
    )


def difference_jacobian(residual: Residual, theta: Array, scale: Array) -> Array:
    """Central differences with steps of 1e-3 of `scale`: (n, p)."""
    columns = []
    for index, size in enumerate(scale):
        step = np.zeros_like(theta)
        step[index] = 1e-3 * size
        columns.append((residual(theta + step) - residual(theta - step)) / (2.0 * step[index]))
    return np.stack(columns, axis=1)


def minimise(problem: Problem, parameters: Parameters, start: Array, most: int = MAX_ITERATIONS) -> tuple[Array, Check]:
    """Search from `start` until a step promises nothing that matters, by the slopes, or `most` are taken."""
    root = 1.0 / parameters.sigma

    def cost_at(theta: Array) -> float:
        return problem.cost(theta) + _cost((theta - parameters.value) * root)

    theta = parameters.clipped(start)
    scale = parameters.scale
    cost, damping = cost_at(theta), 0.0
    for iteration in range(1, most + 1):
        priors = np.column_stack([np.diag(root), (theta - parameters.value) * root])
        reduced = triangle(np.vstack([problem.triangle(theta), priors]) * np.append(scale, -1.0))
        R, rhs = reduced[:, :-1], reduced[:, -1]
        if iteration == 1:
            _refuse_singular(R, parameters.names)
        while True:
            candidate = damped_step(R, rhs, damping, theta, parameters)
            if _cost(rhs) - _cost(rhs - R @ ((candidate - theta) / scale)) < _PROMISE:
                return theta, Check("converged", True, f"{iteration} iteration{'s' * (iteration > 1)}")
            candidate = problem.bent(theta, candidate)
            new = cost_at(candidate)
            if new <= cost or damping > _LARGEST_DAMPING:
                break
            damping = max(10.0 * damping, 1e-6)
        if new <= cost:
            theta, cost = candidate, new
        damping = 0.0 if damping <= 1e-6 else damping / 10.0
    return theta, Check("converged", False, f"{most} iterations")


def damped_step(R: Array, rhs: Array, damping: float, theta: Array, parameters: Parameters) -> Array:
    """Where a step from `theta` leads within bounds: numbers that would cross them are held there, the others follow.

    R (k, p) and `rhs` (k,) are for steps in units of the parameters' scales.
    """
    scale = parameters.scale
    damped = np.vstack([R, np.sqrt(damping) * np.diag(np.linalg.norm(R, axis=0))])
    wanted = np.concatenate([rhs, np.zeros(R.shape[1])])
    reached = theta + scale * np.asarray(lstsq(damped, wanted)[0])
    held = np.zeros(len(theta), dtype=np.bool_)
    while (crossing := ~held & ((near := parameters.clipped(reached)) != reached)).any():
        held |= crossing
        reached[held] = near[held]
        if held.all():
            break
        known = wanted - damped[:, held] @ ((reached - theta) / scale)[held]
        reached[~held] = theta[~held] + scale[~held] * lstsq(damped[:, ~held], known)[0]
    return parameters.clipped(reached)


def _cost(r: Array) -> float:
    cost = float(r @ r)
    return cost if np.isfinite(cost) else np.inf


def triangle(A: Array) -> Array:
    """Return R of A = Q R."""
    return np.asarray(np.linalg.qr(A, mode="r"), dtype=np.float64)


def _inverse(J: Array, precision: Array, parameters: Parameters) -> Array:
    scale = parameters.scale
    R = triangle(np.vstack([J, np.diag(np.sqrt(precision))]) * scale)
    _refuse_singular(R, parameters.names)
    _, s, Vt = np.linalg.svd(R)
    root = Vt.T / s * scale[:, None]
    inverse: Array = np.asarray(root @ root.T, dtype=np.float64)
    return inverse


def _refuse_singular(R: Array, names: tuple[str, ...]) -> None:
    length = np.linalg.norm(R, axis=0)
    dead = [name for name, size in zip(names, length, strict=True) if size == 0.0]
    if dead:
        raise FitError(f"the recordings say nothing about {', '.join(dead)}", remedy="give it a prior, or leave it out")
    _, s, Vt = np.linalg.svd(R / length)
    if s[-1] > _SINGULAR * s[0]:
        return
    terms = combination(Vt[-1] / length, names)
    raise FitError(
        f"these recordings cannot tell these parameters apart: {terms}",
        remedy="add a recording that moves them differently, give one of them a prior, or leave it out",
    )


def combination(direction: Array, names: tuple[str, ...]) -> str:
    """The combination of parameters along a direction in words, greatest terms first."""
    scaled = direction / np.abs(direction).max()
    order = [index for index in np.argsort(-np.abs(scaled)) if abs(scaled[index]) > 0.05]
    return " ".join(f"{scaled[index]:+.3g} {names[index]}" for index in order[:6])


def _at_least(sandwich: Array, model: Array) -> Array:
    """`sandwich`, stretched where its variances are below those of `model`: few samples flatter it."""
    stretch = np.sqrt(np.maximum(1.0, np.diag(model) / np.maximum(np.diag(sandwich), 1e-300)))
    covariance: Array = sandwich * np.outer(stretch, stretch)
    return covariance


def _bounds_check(theta: Array, parameters: Parameters) -> Check:
    stuck = parameters.stuck(theta)
    return Check("within bounds", not stuck, f"at a bound: {', '.join(stuck)}" if stuck else "none at a bound")


def _identifiable_check(R: Array, sigma: Array, covariance: Array, parameters: Parameters) -> Check:
    """Which estimates are little more than their prior, and which pairs only their combination is known of.

    Prior only: sigma posterior / sigma prior > 0.9. Confused: |correlation| > 0.98 with the named partner.
    """
    correlation = covariance / np.outer(sigma, sigma) - np.eye(len(sigma))
    partner = np.argmax(np.abs(correlation), axis=1)
    informed = np.linalg.norm(R, axis=0) * parameters.sigma
    prior_only, confused = [], []
    for index, name in enumerate(parameters.names):
        other = parameters.names[partner[index]]
        if np.abs(correlation[index, partner[index]]) > _CONFUSED:
            confused.append(f"{name} with {other}")
        elif np.isfinite(parameters.sigma[index]) and sigma[index] > _WEAK * parameters.sigma[index]:
            seen = informed[index] > _SEEN
            prior_only.append(f"{name} (hidden by {other})" if seen else f"{name} (no effect on these recordings)")
    parts = []
    if prior_only:
        parts.append("prior only: " + ", ".join(prior_only))
    if confused:
        parts.append("confused: " + ", ".join(confused))
    return Check("identifiable", not parts, "; ".join(parts) or "the data inform every parameter")
