"""The search for the known parameters: Gauss-Newton with Levenberg's damping on the normal equations.

Slopes are differences of the plant. They are taken anew where a step went otherwise than they promised; else they are
updated by what the step gave (Broyden, Math. Comp. 19:577, 1965). Phases, and where tooth contact begins and ends, have
minima by the dozen: they are tried on grids, all other numbers following as the slopes say.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from kbs_process.diagnosis.experiment import Experiment
from kbs_process.diagnosis.floor import Floor
from kbs_process.diagnosis.hypothesis import Hypothesis, Prediction, Simulate
from kbs_process.diagnosis.metric import Metric, metrics
from kbs_process.diagnosis.parameters import Slopes, prior, slopes
from kbs_process.diagnosis.phasing import stages
from kbs_process.signals.records import Array
from kbs_process.stages.identification import gearbox
from kbs_process.stages.output_error import Scalar
from kbs_process.stages.polar import Polar
from kbs_process.stages.screening import Phase, phases

_DIFFERENCE = 0.05  # prior sigmas (phases: rad), first difference
_SEEN = 5.0  # what a difference should move the whitened residual by
_LEAST_DIFFERENCE, _MOST_DIFFERENCE = 2e-3, 0.4  # prior sigmas
_DAMPING = (0.0, 1e-2, 1e-1, 1.0, 10.0, 1e3)  # tried two at a time
_AGREED = 0.9  # gained over promised, above which slopes are only updated
GAIN = 2.0  # of -2 log likelihood: a step that promises less ends the search
_NEGLIGIBLE = (
    0.1  # of the whitened residual's length: what a number moves by one sigma and is not looked at again
)
_POOR = 0.5  # gained over promised, below which all slopes are taken anew, once
_CALM = 1.3  # over the floor, below which phases are not looked for again before the end
_REPHASED = 2  # every how many rounds
_LITTLE = 5.0  # of the same: what exact slopes gained, below which more rounds are not worth their time
_BETTER = 10.0  # for which phases are moved
_RISE = 1.5  # times the cost, that a move of phases may bring before the others have settled
_SMOOTH, _RING = 8, 16  # phases tried all round
_WIDTHS = (-1.0, 0.0, 1.0)  # prior sigmas
_FINE = (-0.1, -0.05, 0.0, 0.05, 0.1)  # rad, then

Predictions = dict[int, Prediction]  # by drive
Gradients = dict[int, Slopes]  # by drive


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """Where the search stands."""

    theta: Array
    predicted: Predictions
    gradients: Gradients
    converged: bool = False
    rounds: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class _Step:
    theta: Array
    predicted: Predictions
    promised: float
    gained: float


class Search:
    """The cost of one experiment under one floor, and how it is lowered."""

    def __init__(
        self,
        experiment: Experiment,
        floor: Floor,
        simulate: Simulate,
        hypothesis: Hypothesis,
        free: tuple[Scalar, ...],
    ) -> None:
        self.experiment, self.simulate, self.hypothesis, self.free = experiment, simulate, hypothesis, free
        self.parameters = prior(hypothesis.rig, experiment.rig, hypothesis.effects, free)
        self.pairs = phases(hypothesis.rig, hypothesis.effects, free)
        self.polar = Polar.of(self.pairs, self.parameters)
        self.precision = self.parameters.sigma**-2.0
        known = np.isfinite(self.parameters.sigma)
        self.spread = np.where(known, self.parameters.sigma, 1.0)
        # A phase that nothing shows would leave the equations singular.
        self.ridge = np.where(known, 0.0, np.pi**-2.0)
        self.differences = _DIFFERENCE * self.spread
        gears = {scalar.name for scalar in gearbox(hypothesis.rig, hypothesis.effects)}
        self.slow = [i for i, scalar in enumerate(free) if scalar.name not in gears]
        trials = experiment.trials
        self.everything = sorted({trial.drive for trial in trials})
        self.drives = sorted({trials[k].drive for k in experiment.fit})
        self.references = sorted({experiment.reference(trials[k].trajectory) for k in experiment.fit})
        self.calibrations = {trial.drive for trial in trials if trial.role == "calibration"}
        self.floor = floor
        self.metric: tuple[Metric, ...] = ()
        self.idle: dict[int, list[int]] = {}

    # what a point costs

    def predict(self, thetas: Sequence[Array], drives: Sequence[int]) -> list[Predictions]:
        """Predictions of drives at some points, all at once."""
        tasks = [(drive, self.hypothesis.at(self.free, theta)) for theta in thetas for drive in drives]
        found = iter(self.simulate(tasks))
        return [{drive: next(found) for drive in drives} for _ in thetas]

    def residual(self, k: int, predicted: Predictions) -> Array:
        """Whitened residual of a trial."""
        trial = self.experiment.trials[k]
        return self.metric[k](trial.measured - predicted[trial.drive].values)

    def cost(self, theta: Array, predicted: Predictions) -> tuple[float, float]:
        """-2 log likelihood, and that of the prior."""
        data = sum(float(z @ z) for z in (self.residual(k, predicted) for k in self.experiment.fit))
        return data if np.isfinite(data) else np.inf, self.excess(theta)

    def excess(self, theta: Array) -> float:
        moved = (theta - self.parameters.value) / self.parameters.sigma
        return float(moved @ moved)

    def jacobian(self, k: int, gradients: Gradients) -> Array:
        """(rows, p) of a trial."""
        reference = self.experiment.reference(self.experiment.trials[k].trajectory)
        return self.metric[k](np.moveaxis(gradients[reference].columns, 0, 2))

    def normal(self, gradients: Gradients, predicted: Predictions) -> tuple[Array, Array]:
        """Normal matrix (p, p) and right-hand side (p,) of the data."""
        p = len(self.free)
        H, g = np.zeros((p, p)), np.zeros(p)
        for k in self.experiment.fit:
            J = self.jacobian(k, gradients)
            H += J.T @ J
            g += J.T @ self.residual(k, predicted)
        return H, g

    # how it is lowered

    def begin(self) -> Found:
        """The hypothesis as it is, with slopes; its nuisances and its encoders' rounding are the metric's."""
        theta = self.hypothesis.values(self.free)
        predicted = self.predict([theta], self.everything)[0]
        self.metric = metrics(self.experiment, self.floor, predicted)
        found = Found(theta, predicted, self.slopes(theta, {}))
        self.idle = {drive: self._idle(drive, found.gradients) for drive in self.references}
        return found

    def _idle(self, drive: int, gradients: Gradients) -> list[int]:
        """Numbers that a drive shows nothing of, such as those of joints that it does not turn."""
        length = np.zeros(len(self.free))
        for k in self.experiment.fit:
            if self.experiment.reference(self.experiment.trials[k].trajectory) == drive:
                length += np.sum(self.jacobian(k, gradients) ** 2, axis=0)
        return [int(i) for i in np.flatnonzero(np.sqrt(length) * self.spread < _NEGLIGIBLE)]

    def run(self, found: Found, rounds: int) -> Found:
        """Lower the cost until no step promises `GAIN`; while much is left, phases are looked for again and again."""
        exact, refreshed = True, False
        for number in range(1, rounds + 1):
            H, g = self.normal(found.gradients, found.predicted)
            self.settle(H)
            step = self.step(found.theta, found.predicted, H, g)
            if step.promised < GAIN or (exact and refreshed and step.gained < _LITTLE):
                return replace(found, converged=True, rounds=number)
            ratio = step.gained / step.promised
            if step.gained > 0.0:
                gradients = self.updated(found.gradients, found.theta, step)
                found = replace(found, theta=step.theta, predicted=step.predicted, gradients=gradients)
            rough = self.level(found) > _CALM and number % _REPHASED == 0
            moved = self.rephased(found) if rough else None
            exact = moved is not None or ratio < _AGREED
            if moved is not None:
                found = moved
            elif exact:
                # Those of bodies hardly change, but for what resonances do to them once these are where they belong.
                whole = not refreshed and ratio < _POOR and self.level(found) < _CALM
                refreshed = refreshed or whole
                slopes = self.slopes(found.theta, found.gradients, whole=whole)
                found = replace(found, gradients=slopes)
        return replace(found, rounds=rounds)

    def level(self, found: Found) -> float:
        """What is left of the trials that are fitted, over the floor."""
        rows = sum(self.metric[k].rows for k in self.experiment.fit)
        return self.cost(found.theta, found.predicted)[0] / rows

    def slopes(self, theta: Array, held: Gradients, *, whole: bool = False) -> Gradients:
        """Slopes at theta; where some are held, only those of drives' and transducer's numbers are taken again.

        With `whole` all are, but in calibrations, which hardly shake anything.
        """
        keep = {}
        for drive, slope in held.items():
            slow = [] if whole and drive not in self.calibrations else self.slow
            keep[drive] = ([*slow, *self.idle.get(drive, ())], slope.columns)
        here = self.hypothesis.at(self.free, theta)
        return slopes(
            self.experiment, here, self.free, self.differences, self.references, self.simulate, keep=keep
        )

    def updated(self, gradients: Gradients, theta: Array, step: _Step) -> Gradients:
        """Broyden's update, lengths in prior sigmas."""
        moved = (step.theta - theta) / self.spread
        along = moved / (moved @ moved) / self.spread
        new = {}
        for drive, slope in gradients.items():
            promised = np.tensordot(step.theta - theta, slope.columns, axes=1)
            missed = step.predicted[drive].values - slope.base.values - promised
            new[drive] = Slopes(step.predicted[drive], slope.columns + along[:, None, None] * missed)
        return new

    def settle(self, H: Array) -> None:
        """Differences that move the whitened residual by about `_SEEN`."""
        length = np.sqrt(np.maximum(np.diag(H), 1e-300))
        self.differences = np.clip(
            _SEEN / length, _LEAST_DIFFERENCE * self.spread, _MOST_DIFFERENCE * self.spread
        )

    def step(self, theta: Array, predicted: Predictions, H: Array, g: Array) -> _Step:
        """One step in the chart of cosines and sines, as long as lowers the cost."""
        data, excess = self.cost(theta, predicted)
        # While much is unexplained, residuals count for less, so that no step is rash.
        rows = sum(self.metric[k].rows for k in self.experiment.fit)
        weight = 1.0 / max(1.0, data / rows)
        T = self.polar.jacobian(np.eye(len(theta)), theta)[: len(theta)]
        A = T.T @ (weight * H + np.diag(self.precision + self.ridge)) @ T
        b = T.T @ (weight * g - self.precision * (theta - self.parameters.value))
        scale = 1.0 / np.sqrt(np.diag(A))
        A = A * np.outer(scale, scale)
        assert self.parameters.lower is not None and self.parameters.upper is not None
        candidates, promised = [], 0.0
        for damping in _DAMPING:
            du = cho_solve(cho_factor(A + damping * np.eye(len(b))), scale * b)
            promised = promised or float(2.0 * (scale * b) @ du - du @ A @ du) / weight
            moved = self.polar.back(self.polar.flat(theta) + scale * du)
            candidates.append(np.clip(moved, self.parameters.lower, self.parameters.upper))
        if promised < GAIN:
            return _Step(theta, predicted, promised, 0.0)
        now = weight * data + excess
        for pair in zip(candidates[::2], candidates[1::2], strict=True):
            tried = self.predict(pair, self.drives)
            costs = [weight * d + e for d, e in itertools.starmap(self.cost, zip(pair, tried, strict=True))]
            best = int(np.argmin(costs))
            if costs[best] < now:
                return _Step(pair[best], {**predicted, **tried[best]}, promised, (now - costs[best]) / weight)
        return _Step(theta, predicted, promised, 0.0)

    # phases, by trial

    def rephased(self, found: Found) -> Found | None:
        """Move phases to better minima, where there are any, the other numbers following as the slopes say.

        What a weak effect does shows only once the strong ones are right. A smooth phase is tried all round with its
        amplitude as it is known; tooth contact, whose edges matter, all round at three widths, then finely there.
        """
        theta = found.theta
        J = {k: self.jacobian(k, found.gradients) for k in self.experiment.fit}
        for pair in self.pairs:
            trials = next(
                (used for used, joints in stages(self.experiment) if self._joint(pair) in joints), ()
            )
            partner = pair.amplitude if pair.smooth else self._width(pair)
            if not trials or partner is None:
                continue
            middle, spread = self.parameters.value[partner], self.parameters.sigma[partner]
            count, widths = (_SMOOTH, (0.0,)) if pair.smooth else (_RING, _WIDTHS)
            ring = [(2.0 * np.pi * k / count, middle + w * spread) for k in range(count) for w in widths]
            theta = self._best(found, J, theta, (pair.phase, partner), trials, ring)
            if not pair.smooth:
                fine = [(theta[pair.phase] + a, theta[partner] + b) for a in _FINE for b in _FINE]
                theta = self._best(found, J, theta, (pair.phase, partner), trials, fine)
        if theta is found.theta:
            return None
        predicted = self.predict([theta], self.everything)[0]
        now, then = sum(self.cost(found.theta, found.predicted)), sum(self.cost(theta, predicted))
        if then > _RISE * now:  # the slopes promised what is far from true
            return None
        return replace(
            found,
            theta=theta,
            predicted=predicted,
            gradients=self.slopes(theta, found.gradients),
            converged=False,
        )

    def _joint(self, pair: Phase) -> str:
        return self.free[pair.phase].name.split(".")[1]

    def _width(self, pair: Phase) -> int | None:
        """The number of the same joint that says how wide a contact is."""
        width = self.free[pair.phase].quantity.rpartition(".")[0] + ".delta"
        return next((i for i, scalar in enumerate(self.free) if scalar.quantity == width), None)

    def _best(
        self,
        found: Found,
        J: Mapping[int, Array],
        theta: Array,
        moved: tuple[int, int],
        trials: Sequence[int],
        values: Sequence[tuple[float, float]],
    ) -> Array:
        """The best of some values of two numbers; `theta` itself where none is better by `_BETTER`."""
        rest = np.delete(np.arange(len(self.free)), moved)
        assert self.parameters.lower is not None and self.parameters.upper is not None
        prior = np.diag((self.precision + self.ridge)[rest])
        factor = cho_factor(sum((j[:, rest].T @ j[:, rest] for j in J.values()), prior))
        # Trials in which the moved numbers show little hold the others by what they already say.
        held = np.zeros(len(rest))
        for k in set(J) - set(trials):
            left = self.residual(k, found.predicted) - J[k] @ (theta - found.theta)
            held += J[k][:, rest].T @ left
        points = [theta]
        for value in values:
            point = theta.copy()
            point[list(moved)] = value
            points.append(np.clip(point, self.parameters.lower, self.parameters.upper))
        drives = sorted({self.experiment.trials[k].drive for k in trials})
        costs, follows = [], []
        for point, predicted in zip(points, self.predict(points, drives), strict=True):
            z = {k: self.residual(k, predicted) for k in trials}
            excess = (point - self.parameters.value) * self.precision
            g = sum((J[k][:, rest].T @ z[k] for k in trials), held - excess[rest])
            follow = cho_solve(factor, g)
            cost = sum(float(r @ r) for r in z.values()) + self.excess(point) - float(g @ follow)
            costs.append(cost if np.isfinite(cost) else np.inf)
            follows.append(follow)
        chosen = int(np.argmin(costs))
        if costs[chosen] > costs[0] - _BETTER:
            return theta
        better = points[chosen].copy()
        better[rest] += follows[chosen] - follows[0]
        return np.clip(better, self.parameters.lower, self.parameters.upper)
