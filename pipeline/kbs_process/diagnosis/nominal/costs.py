"""What points of the search for the known parameters cost, and the minimum between bounds as slopes at one have it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, Prediction, Simulate
from kbs_process.diagnosis.experiments.metric import Metric
from kbs_process.diagnosis.nominal.parameters import Slopes, known_parameters
from kbs_process.diagnosis.side_by_side import side_by_side
from kbs_process.estimation.bounded import bounded_minimum
from kbs_process.estimation.fit import Parameters
from kbs_process.identification.objective import DIFFERENCE
from kbs_process.identification.output_error import Scalar
from kbs_process.identification.polar import Polar
from kbs_process.identification.screening import phases
from kbs_process.identification.unknowns import gearbox
from kbs_process.signals.records import Array, Mask

_RIDGE = 1e-10  # of unit columns: numbers that nothing shows would leave the equations singular
GROSS = 1.0  # of the noise: wrong phases alone have left 0.8
# Which slopes are taken where the search stands: none, those of suspects alone, of drives too, all.
OLD, OWN, GEARS, ALL = range(4)

Predictions = dict[int, Prediction]  # by drive
Gradients = dict[int, Slopes]  # by drive
# Columns (n, c) by the number that multiplies them, and reference drive.
Laws = Mapping[str, Mapping[int, Array]]


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """Where the search stands."""

    theta: Array
    predicted: Predictions  # of drives that were simulated here: those that are fitted, at least
    gradients: Gradients
    converged: bool = False
    rounds: int = 0
    due: int = OLD  # which slopes are to be taken before the next step


class Costs:
    """The cost of one experiment under one floor, of plants with some numbers free."""

    def __init__(
        self,
        experiment: Experiment,
        metric: tuple[Metric, ...],
        simulate: Simulate,
        hypothesis: Hypothesis,
        free: tuple[Scalar, ...],
        parameters: Parameters,
        laws: Laws | None = None,
        scale: Array | None = None,
    ) -> None:
        """`laws` are columns of the prediction by the names of free numbers that no rig has; `scale` says in what
        steps free numbers go that have no stated prior (p,), if not their own size.
        """
        self.experiment, self.metric, self.simulate = experiment, metric, simulate
        self.hypothesis, self.free, self.parameters = hypothesis, free, parameters
        self.laws = laws or {}
        self.inside = [i for i, scalar in enumerate(free) if scalar.name not in self.laws]
        self.pairs = phases(hypothesis.rig, hypothesis.effects, free)
        self.polar = Polar.of(self.pairs, self.parameters)
        self.precision = self.parameters.sigma**-2.0
        gears = set(gearbox(experiment.rig, experiment.effects))
        phase = np.array([one in gears for one in free], dtype=np.bool_) & ~np.isfinite(parameters.sigma)
        size = np.ones(len(free))
        size[self.inside] = np.abs(hypothesis.values([free[i] for i in self.inside]))
        self.scale = np.where(phase, 1.0, np.maximum(size if scale is None else scale, 1e-12))
        # A phase that nothing shows would leave the equations singular.
        self.ridge = np.where(phase, np.pi**-2.0, 0.0)
        trials = experiment.trials
        self.everything = sorted({trial.drive for trial in trials})
        self.drives = sorted({trials[k].drive for k in experiment.fit})
        self.references = sorted({experiment.reference(trials[k].trajectory) for k in experiment.fit})
        self.alike = {trial.drive: experiment.reference(trial.trajectory) for trial in trials}
        # What slopes are taken by.
        files = set(known_parameters(experiment.rig, experiment.effects))
        # A law's number has a prior that is wider by far than it is large.
        self.stated = np.array([one in files for one in free], dtype=np.bool_) & np.isfinite(parameters.sigma)
        self.spread = np.where(self.stated, parameters.sigma, self.scale)
        self.differences = DIFFERENCE * self.spread
        self.slow = [i for i, scalar in enumerate(free) if scalar in files - gears]
        self.geared = [i for i, scalar in enumerate(free) if scalar in gears]
        self.calibrations = {trial.drive for trial in trials if trial.role == "calibration"}
        self.idle: dict[int, list[int]] = {}
        self.bodies_at: Array | None = None  # where slopes of bodies were taken last

    @property
    def rows(self) -> int:
        """Numbers of noise in the trials that are fitted."""
        return sum(self.metric[k].rows for k in self.experiment.fit)

    def predict(self, thetas: Sequence[Array], drives: Sequence[int]) -> list[Predictions]:
        """Predictions of drives at some points, all at once."""
        here = [self.at(theta) for theta in thetas]
        found = iter(self.simulate([(drive, hypothesis) for hypothesis in here for drive in drives]))
        return [{drive: self.shown(theta, drive, next(found)) for drive in drives} for theta in thetas]

    def at(self, theta: Array) -> Hypothesis:
        """The plant with all numbers that are its own."""
        return self.hypothesis.at([self.free[i] for i in self.inside], theta[self.inside])

    def shown(self, theta: Array, drive: int, plant: Prediction) -> Prediction:
        """A prediction with the laws that are columns of it."""
        if not self.laws:
            return plant
        return replace(plant, values=plant.values + added(self.laws, self.free, theta, self.alike[drive]))

    def residual(self, k: int, predicted: Predictions) -> Array:
        """Whitened residual of a trial."""
        trial = self.experiment.trials[k]
        return self.metric[k](trial.measured - predicted[trial.drive].values)

    def cost(self, theta: Array, predicted: Predictions) -> tuple[float, float]:
        """-2 log likelihood, and that of the prior."""
        data = sum(float(z @ z) for z in (self.residual(k, predicted) for k in self.experiment.fit))
        return data if np.isfinite(data) else np.inf, self.excess(theta)

    def costs(self, thetas: Sequence[Array], predicted: Sequence[Predictions]) -> list[tuple[float, float]]:
        """`cost` of several points."""
        return side_by_side(lambda one: self.cost(*one), list(zip(thetas, predicted, strict=True)))

    def excess(self, theta: Array) -> float:
        moved = (theta - self.parameters.value) / self.parameters.sigma
        return float(moved @ moved)

    def height(self, found: Found) -> float:
        """-2 log posterior, but for a constant."""
        return sum(self.cost(found.theta, found.predicted))

    def left(self, found: Found) -> float:
        """-2 log likelihood beyond that of noise."""
        return self.cost(found.theta, found.predicted)[0] - self.rows

    def gross(self, found: Found) -> bool:
        """Whether so much is left that something is missing, or wrong by far."""
        return self.left(found) > GROSS * self.rows

    def jacobian(self, k: int, gradients: Gradients) -> Array:
        """(rows, p) of a trial."""
        reference = self.experiment.reference(self.experiment.trials[k].trajectory)
        return self.metric[k](np.moveaxis(gradients[reference].columns, 0, 2))

    def jacobians(self, gradients: Gradients) -> dict[int, Array]:
        """Those of all trials that are fitted."""
        fit = self.experiment.fit
        return dict(zip(fit, side_by_side(lambda k: self.jacobian(k, gradients), fit), strict=True))

    def room(self, theta: Array) -> tuple[Array, Array]:
        """How far each number may go down and up, in the chart of cosines and sines: these have no bounds."""
        limits = self.polar.flat_parameters
        u = self.polar.flat(theta)
        return np.minimum(limits.lower - u, 0.0), np.maximum(limits.upper - u, 0.0)

    def clipped(self, theta: Array) -> Array:
        """The nearest numbers within bounds."""
        return self.parameters.clipped(theta)


class Ground:
    """Normal equations of data that count `weight` times, and of the prior, in the chart of cosines and sines.

    With slopes J (rows, p) of each trial, whitened, and the chart's T (p, u) at the place, A = T' (w J'J + P) T, scaled
    to a unit diagonal. They hold for other points, too, as far as slopes are the same there.
    """

    def __init__(self, costs: Costs, theta: Array, J: Mapping[int, Array], weight: float) -> None:
        self.costs, self.theta, self.J, self.weight = costs, theta, J, weight
        self.T = costs.polar.jacobian(np.eye(len(theta)), theta)[: len(theta)]
        self.information = information(J)
        A = self.T.T @ (weight * self.information + np.diag(costs.precision + costs.ridge)) @ self.T
        self.scale = 1.0 / np.sqrt(np.maximum(np.diag(A), 1e-300))
        self.A = A * np.outer(self.scale, self.scale)

    def pull(self, theta: Array, predicted: Predictions) -> Array:
        """(u,) minus half the slope of the cost at a point (p,), at which `predicted` holds."""
        costs = self.costs
        data = sum(j.T @ costs.residual(k, predicted) for k, j in self.J.items())
        prior = costs.precision * (theta - costs.parameters.value)
        return np.asarray(self.scale * (self.T.T @ (self.weight * data - prior)), dtype=np.float64)

    def minimum(self, theta: Array, pull: Array, damping: float = 0.0) -> tuple[Array, float]:
        """The point (p,) where the cost is least from `theta` on, which is pulled so, and what it promises.

        `damping` is Levenberg's and Marquardt's: 0 for the step of Gauss and Newton.
        """
        costs = self.costs
        low, high = costs.room(theta)
        du = bounded_minimum(self.A + (_RIDGE + damping) * np.eye(len(pull)), pull, low / self.scale, high / self.scale)
        point = costs.clipped(costs.polar.back(costs.polar.flat(theta) + self.scale * du))
        return point, float(2.0 * pull @ du - du @ self.A @ du) / self.weight

    def valleys(self, among: Mask, share: float, length: float) -> list[Array]:
        """Points (p,), some standard deviations off along principal directions with an eigenvalue below `share`.

        Of the numbers `among` (p,), while the others stay. Of one that nothing shows, no standard deviation is known.
        """
        costs = self.costs
        here = costs.polar.flat(self.theta)
        low, high = costs.room(self.theta)
        points = list[Array]()
        if not (among.any() and np.isfinite(self.A).all()):
            return points
        for value, direction in zip(*_principal(self.A[np.ix_(among, among)]), strict=True):
            if _RIDGE < value < share:
                du = np.zeros(len(here))
                du[among] = self.scale[among] * direction * (length / np.sqrt(value))
                points.append(costs.clipped(costs.polar.back(here + np.clip(du, low, high))))
        return points


def information(J: Mapping[int, Array]) -> Array:
    """(p, p) of all trials' slopes together."""
    return np.asarray(sum(j.T @ j for j in J.values()), dtype=np.float64)


def _principal(A: Array) -> tuple[Array, Array]:
    """Eigenvalues (u,) from the least on, and eigenvectors, one in each row, with their largest element positive."""
    values, vectors = np.linalg.eigh(A)
    largest = np.argmax(np.abs(vectors), axis=0)
    return values, (vectors * np.sign(vectors[largest, np.arange(len(values))])).T


def added(laws: Laws, free: Sequence[Scalar], values: Array, reference: int) -> Array | float:
    """(n, c) what laws that are columns of the prediction add to it along a reference drive's path."""
    return sum(
        (
            value * laws[scalar.name][reference]
            for scalar, value in zip(free, values, strict=True)
            if scalar.name in laws
        ),
        0.0,
    )
