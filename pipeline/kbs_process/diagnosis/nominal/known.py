"""Can the known parameters explain it? Their maximum a posteriori over all trials that are not held out.

    theta = argmin sum_trials |P W (y - m(theta))|^2 + sum ((theta - theta_0) / sigma_0)^2

W whitens by the repeatability floor, P takes each trial's own nuisances out. Phases have no prior; they enter as cosine
and sine amplitudes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.floor import Floor
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, Prediction, Simulate
from kbs_process.diagnosis.experiments.metric import Metric, metrics, softened
from kbs_process.diagnosis.facts import Moved
from kbs_process.diagnosis.nominal.costs import ALL, GROSS, Found, Laws, information
from kbs_process.diagnosis.nominal.parameters import Slopes, known_parameters, prior, within
from kbs_process.diagnosis.nominal.search import EARLY, LITTLE, Search
from kbs_process.estimation.fit import Check, Parameters
from kbs_process.identification.output_error import Scalar
from kbs_process.signals.records import Array, Mask

# Sigmas, from which a parameter is said to be off: of a hundred that are not, one in 160 campaigns has one.
MOVED = 4.0
NEAR = 0.99 * MOVED  # sigmas that numbers are let go before any may be off
# Chance below which all together are said to be off: no single one need be, where many make up for what was left out.
STRAINED = 1e-3
LEARNT = 0.05  # share of a direction's prior variance that recordings take away, from which on it counts
CONVERGED = "converged"  # name of the check
CONFINED = 8  # steps of a refit that is looked at, or gone on from


@dataclass(frozen=True, slots=True)
class Strain:
    """Squared sigmas, each of what chance moves a direction by, and the directions that they are summed over."""

    squares: float
    count: int

    @property
    def strained(self) -> bool:
        """Whether numbers are together farther from their priors than chance has them."""
        return self.count > 0 and bool(chi2.sf(self.squares, self.count) < STRAINED)


def strain_of(moved: Array, covariance: Array) -> Strain:
    """How far numbers (p,) are from their priors together, as far as recordings tell; all in prior sigmas.

    Where recordings are made by such numbers, and nothing is left out, a fit moves them by N(0, 1 - C): C (p, p) is
    their covariance after it (the law of total variance). Along the principal directions of that squares over variances
    add up to chi square. Validity: a descent that has arrived; along directions that recordings hardly tell (`LEARNT`)
    what a floor is wrong by counts most.
    """
    learnt = np.eye(len(moved)) - covariance
    if not np.isfinite(learnt).all():
        return Strain(0.0, 0)
    variance, directions = np.linalg.eigh(learnt)
    told = variance > LEARNT
    along = directions.T[told] @ moved
    return Strain(float(np.sum(along**2 / variance[told])), int(told.sum()))


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """The known parameters as the recordings have them, and what they leave."""

    experiment: Experiment
    hypothesis: Hypothesis
    free: tuple[Scalar, ...]
    parameters: Parameters  # priors
    scale: Array  # (p,) sizes of steps of numbers that have no prior
    value: Array  # (p,)
    covariance: Array  # (p, p)
    metric: tuple[Metric, ...]  # of each trial
    slopes: dict[int, Slopes]  # by drive
    shown: dict[int, Prediction]  # what they predict, by drive, laws that are columns in it; {}: to be predicted
    residual: tuple[Array, ...]  # of each trial, whitened
    chi2_before: Array  # (trials,)
    checks: tuple[Check, ...]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(scalar.name for scalar in self.free)

    @property
    def sigma(self) -> Array:
        """(p,) standard deviations; a phase that nothing shows has pi."""
        return np.asarray(np.sqrt(np.diag(self.covariance)), dtype=np.float64)

    @property
    def moved(self) -> Array:
        """(p,) prior sigmas; nan for phases, which have none."""
        spread = self.parameters.sigma
        finite = np.isfinite(spread)
        return np.where(finite, (self.value - self.parameters.value) / np.where(finite, spread, 1.0), np.nan)

    @property
    def precision(self) -> Array:
        """(p,) that of the priors; 0 for phases, which have none."""
        return np.asarray(self.parameters.sigma**-2.0, dtype=np.float64)

    @property
    def offset(self) -> Array:
        """(p,) how far the priors' means are from where numbers are; 0 for phases."""
        return np.where(self.precision > 0.0, self.parameters.value - self.value, 0.0)

    @property
    def room(self) -> tuple[Array, Array]:
        """How far numbers may go down and up, (p,) each."""
        limits = self.parameters
        return np.minimum(limits.lower - self.value, 0.0), np.maximum(limits.upper - self.value, 0.0)

    @property
    def chi2(self) -> Array:
        """(trials,) squared lengths of the residuals."""
        return np.array([float(z @ z) for z in self.residual])

    @property
    def rows(self) -> Array:
        """(trials,) numbers of noise in each."""
        return np.array([metric.rows for metric in self.metric])

    @property
    def level(self) -> float:
        """What is left of the trials that were fitted, over the floor."""
        fit = list(self.experiment.fit)
        return float(self.chi2[fit].sum() / self.rows[fit].sum())

    @property
    def converged(self) -> bool:
        """Whether the search that ended here had nothing more to gain."""
        return next(check.passed for check in self.checks if check.name == CONVERGED)

    @property
    def cost(self) -> float:
        """-2 log posterior, less a constant."""
        return float(self.chi2[list(self.experiment.fit)].sum()) + self.prior_chi2

    @property
    def excess(self) -> float:
        """-2 log likelihood beyond that of noise, of the trials that were fitted."""
        return float(self.chi2[list(self.experiment.fit)].sum()) - self.fit_rows

    @property
    def fit_rows(self) -> float:
        """Numbers of noise in the residuals of these trials."""
        return float(self.rows[list(self.experiment.fit)].sum())

    @property
    def gross(self) -> bool:
        """Whether so much is left of these trials that something is missing, or wrong by far."""
        return self.excess > GROSS * self.fit_rows

    @property
    def prior_chi2(self) -> float:
        return float(np.nansum(self.moved**2))

    @property
    def stated(self) -> Mask:
        """(p,) numbers whose prior the files state: of a law's shapes it is a choice of ours."""
        files = set(known_parameters(self.experiment.rig, self.experiment.effects))
        return np.array([one in files for one in self.free], dtype=np.bool_) & np.isfinite(self.moved)

    @property
    def strain(self) -> Strain:
        """Of numbers with a stated prior."""
        chosen = self.stated
        sigma = self.parameters.sigma[chosen]
        return strain_of(self.moved[chosen], self.covariance[np.ix_(chosen, chosen)] / np.outer(sigma, sigma))

    @property
    def strained(self) -> bool:
        """Whether these numbers are together farther from their priors than chance has them."""
        return self.strain.strained

    @property
    def numbers(self) -> tuple[Moved, ...]:
        """Each of the rig's own, before and after; those of laws at a sensor are left out."""
        units = {name: quantity.unit for name, quantity in self.hypothesis.rig.quantities().items()}
        entries = zip(self.free, self.value, self.sigma, self.parameters.value, self.parameters.sigma, strict=True)
        return tuple(
            Moved(
                name=scalar.name,
                unit=units[scalar.quantity],
                prior=float(prior),
                prior_sigma=float(spread) if (bounded := bool(np.isfinite(spread) and spread > 0.0)) else None,
                value=float(value),
                sigma=float(sigma),
                sigmas=float((value - prior) / spread) if bounded else None,
            )
            for scalar, value, sigma, prior, spread in entries
            if scalar.quantity in units
        )

    @property
    def stopped(self) -> tuple[str, ...]:
        """Numbers that were let go no farther than chance has them, and stopped there: what is off may be hidden so."""
        far = self.stated & (np.abs(np.nan_to_num(self.moved)) > 0.99 * NEAR) & (np.abs(self.moved) <= MOVED)
        return tuple(name for name, there in zip(self.names, far, strict=True) if there)

    def jacobian(self, trial: int) -> Array:
        """(rows, p) by which a trial's prediction answers to the parameters, whitened as its residual is."""
        return self.metric[trial](np.moveaxis(self._columns(trial), 0, 2))

    def along(self, trial: int, steps: Array) -> Array:
        """(rows, m) the same to `steps` (p, m) of the parameters."""
        return self.metric[trial](np.tensordot(self._columns(trial), steps, axes=(0, 0)))

    def _columns(self, trial: int) -> Array:
        reference = self.experiment.reference(self.experiment.trials[trial].trajectory)
        return self.slopes[reference].columns


def refit(
    experiment: Experiment,
    hypothesis: Hypothesis,
    floor: Floor,
    simulate: Simulate,
    *,
    reach: float = np.inf,
    slopes: dict[int, Slopes] | None = None,
    leaps: int,
    near: bool = False,
) -> Known:
    """Refit all known parameters from `hypothesis` on, whose phases are near their right values (see `phasing`).

    No number goes farther than `reach` sigmas from its prior. Phases and edges are looked for all round up to `leaps`
    times; `slopes` at the hypothesis need not be taken again. Begun `near` the best, what promises
    less than chance moves all numbers by, one each, brings them no nearer.
    """
    free = known_parameters(experiment.rig, experiment.effects)
    parameters = within(prior(hypothesis.rig, experiment.rig, hypothesis.effects, free), reach)
    drives = sorted({trial.drive for trial in experiment.trials})
    predicted = dict(zip(drives, simulate([(drive, hypothesis) for drive in drives]), strict=True))
    metric = metrics(experiment, floor, predicted, hypothesis)
    search = Search(experiment, metric, simulate, hypothesis, free, parameters)
    begun = search.begin(hypothesis.values(free), slopes, predicted)
    before = np.array([float(z @ z) for z in residuals(search, begun)])
    return known_of(search, search.run(begun, leaps=leaps, least=len(free) if near else LITTLE), before)


def settled(known: Known, simulate: Simulate, *, leaps: int, laws: Laws | None = None) -> Known:
    """Refit all numbers of `known`, those of suspects too, along slopes of the plant that has these in it.

    Where so much is left that something is missing, wrong phases would do as well as right ones: no leaps then.
    """
    search, begun = _again(known, simulate, laws)
    found = replace(begun, gradients=search.slopes(begun.theta, begun.gradients))
    if leaps:
        found = search.descend(found, EARLY, giving_up=True)
    if not search.gross(found):
        found = search.run(found, leaps=leaps)
    return known_of(search, found, known.chi2_before)


def as_it_is(known: Known, simulate: Simulate, *, laws: Laws | None = None) -> Known:
    """The numbers of `known` where they are, with what they leave and how well they are known."""
    return known_of(*_again(known, simulate, laws), known.chi2_before)


def confined(known: Known, simulate: Simulate, reach: float, *, laws: Laws | None = None) -> Known:
    """Refit all numbers of `known`, those with a stated prior no farther than `reach` sigmas from it, along new slopes.

    In the metric that takes what is left for noise (`softened`): what is left out shows there, before numbers take it
    up. What is returned has the metric and the bounds of `known`.
    """
    experiment = known.experiment

    def search(metric: tuple[Metric, ...], limits: Parameters) -> Search:
        return Search(experiment, metric, simulate, known.hypothesis, known.free, limits, laws, known.scale)

    plain = search(known.metric, known.parameters)
    begun = plain.begin(known.value, known.slopes, known.shown)
    left = {k: plain.residual(k, begun.predicted) for k in experiment.fit}
    soft = search(
        softened(experiment, known.metric, left, begun.predicted, known.hypothesis),
        within(known.parameters, reach, known.stated),
    )
    theta = soft.clipped(known.value)
    found = soft.descend(soft.begin(theta, soft.slopes(theta, known.slopes, ALL)), CONFINED)
    return known_of(plain, replace(found, converged=False), known.chi2_before)


def resumed(known: Known, simulate: Simulate, *, laws: Laws | None = None, leaps: bool = True) -> Known:
    """Go on with the refit of a suspect's numbers and all others: from better phases, if `leaps` find any."""
    search, begun = _again(known, simulate, laws)
    moved = search.leapt(begun, smooth=True) if leaps else None
    begun = moved or replace(begun, gradients=search.slopes(begun.theta, begun.gradients))
    return known_of(search, search.descend(begun, giving_up=True), known.chi2_before)


def leapt(known: Known, simulate: Simulate, *, smooth: bool) -> Known:
    """Look for better phases (those that enter smoothly too if `smooth`) and edges all round, and refit from there."""
    search, begun = _again(known, simulate)
    moved = search.leapt(begun, smooth=smooth)
    if moved is None:
        return known
    return known_of(search, search.descend(moved, giving_up=True), known.chi2_before)


def _again(known: Known, simulate: Simulate, laws: Laws | None = None) -> tuple[Search, Found]:
    """A search that begins where another ended."""
    search = Search(
        known.experiment, known.metric, simulate, known.hypothesis, known.free, known.parameters, laws, known.scale
    )
    return search, search.begin(known.value, known.slopes, known.shown)


def residuals(search: Search, found: Found) -> tuple[Array, ...]:
    """Whitened residuals of all trials."""
    return tuple(search.residual(k, found.predicted) for k in range(len(search.experiment.trials)))


def known_of(search: Search, found: Found, before: Array) -> Known:
    """What a search has found, with its covariance and checks."""
    # A step predicts the recordings that are fitted alone.
    rest = [drive for drive in search.everything if drive not in found.predicted]
    predicted = {**found.predicted, **search.predict([found.theta], rest)[0]}
    found = replace(found, predicted=predicted)
    H = information(search.jacobians(found.gradients))
    precision = search.precision + search.ridge
    size = 1.0 / np.sqrt(np.maximum(np.diag(H) + precision, 1e-300))
    scaled = (H + np.diag(precision)) * np.outer(size, size)
    # Combinations of a law's numbers that nothing shows have no inverse.
    inverse: Array = np.full_like(H, np.inf)
    if np.isfinite(scaled).all():
        inverse = np.asarray(np.linalg.pinv(scaled, rcond=1e-13, hermitian=True), dtype=np.float64)
    known = Known(
        experiment=search.experiment,
        hypothesis=search.at(found.theta),
        free=search.free,
        parameters=search.parameters,
        scale=search.scale,
        value=found.theta,
        covariance=np.asarray(inverse * np.outer(size, size), dtype=np.float64),
        metric=search.metric,
        slopes=found.gradients,
        shown=predicted,
        residual=residuals(search, found),
        chi2_before=before,
        checks=(),
    )
    return replace(known, checks=_checks(known, found))


def _checks(known: Known, found: Found) -> tuple[Check, ...]:
    far = [f"{name} ({moved:+.1f})" for name, moved in zip(known.names, known.moved, strict=True) if abs(moved) > MOVED]
    stuck = known.parameters.stuck(known.value)
    within, strain = f"all within {MOVED:g} sigma", known.strain
    return (
        Check(CONVERGED, found.converged, f"{found.rounds} rounds"),
        Check("within bounds", not stuck, ", ".join(stuck) or "none at a bound"),
        Check("within uncertainties", not far, "sigmas: " + ", ".join(far) if far else within),
        Check(
            "together within uncertainties",
            not known.strained,
            f"squared sigmas {strain.squares:.0f} in {strain.count} directions that the recordings tell",
        ),
    )
