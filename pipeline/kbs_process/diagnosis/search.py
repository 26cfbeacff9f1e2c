"""The search for the known parameters: Gauss-Newton with Levenberg's damping on the normal equations.

Slopes are differences of the plant. They are taken anew where a step went otherwise than they promised; else they are
updated by what the step gave (Broyden, Math. Comp. 19:577, 1965). Phases, and where tooth contact begins and ends, have
minima by the dozen: see `leaps`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kbs_process.diagnosis.experiment import Experiment
from kbs_process.diagnosis.ground import Ground, information
from kbs_process.diagnosis.hypothesis import Hypothesis, Prediction, Simulate
from kbs_process.diagnosis.leaps import leap, stride
from kbs_process.diagnosis.metric import Metric
from kbs_process.diagnosis.parameters import Slopes, known_parameters, slopes
from kbs_process.diagnosis.side_by_side import side_by_side
from kbs_process.estimation.fit import Parameters
from kbs_process.signals.records import Array
from kbs_process.stages.identification import gearbox
from kbs_process.stages.output_error import Scalar
from kbs_process.stages.polar import Polar
from kbs_process.stages.screening import phases

_DIFFERENCE = 0.05  # prior sigmas (phases: rad), first difference
_SEEN = 5.0  # what a difference should move the whitened residual by
_SPAN = 1.0  # of a step
_LEAST_DIFFERENCE, _MOST_DIFFERENCE = 2e-3, 0.4  # prior sigmas
_DAMPING = (0.0, 1e-2, 1e-1, 1.0, 10.0, 1e3)  # tried side by side
_CHORDED = 3  # of them, the least, that are corrected where none keeps what slopes promise
_CHORDS = 3  # corrections of each
_AGREED = 0.9  # gained over promised, above which slopes are only updated
_HALF = 0.5  # of the same, below which slopes of drives alone do not do
_STALLED = 0.1  # of the same, below which a descent goes nowhere
GROSS = 1.0  # of the noise: wrong phases alone have left 0.8
_HOPE = 0.1  # of what is left: a right model's steps, along slopes taken there, gain more
# Which slopes are taken where the search stands: none, those of suspects alone, of drives too, all.
_OLD, _OWN, GEARS, ALL = range(4)
GAIN = 2.0  # of -2 log likelihood: a step that promises less ends a descent
LITTLE = 25.0  # of the same: what exact slopes gained, below which more rounds are not worth their time
SLIGHT = 3e-2  # of all that is left: likewise
_MUCH = 0.5  # prior sigmas of a body's number, within which its slopes and others' stay what they are
EARLY = 2  # steps before the first leap: masses and centres of gravity are right then
_ROUNDS = 10  # steps of a descent at most
_NEGLIGIBLE = (
    1.0  # of the whitened residual's length: what a number moves by one sigma and is not looked at again
)

Predictions = dict[int, Prediction]  # by drive
Gradients = dict[int, Slopes]  # by drive
Laws = Mapping[
    str, Mapping[int, Array]
]  # columns (n, c) by the number that multiplies them, and reference drive


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """Where the search stands."""

    theta: Array
    predicted: Predictions  # of drives that were simulated here: those that are fitted, at least
    gradients: Gradients
    converged: bool = False
    rounds: int = 0
    due: int = _OLD  # which slopes are to be taken before the next step


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """Where a step leads, and what it gains of what slopes promised."""

    theta: Array
    predicted: Predictions
    promised: float
    gained: float


class Search:
    """The cost of one experiment under one floor, and how it is lowered."""

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
        files = set(known_parameters(experiment.rig, experiment.effects))
        # A law's number has a prior that is wider by far than it is large.
        stated = np.array([one in files for one in free], dtype=np.bool_) & np.isfinite(parameters.sigma)
        self.spread = np.where(stated, parameters.sigma, self.scale)
        # A phase that nothing shows would leave the equations singular.
        self.ridge = np.where(phase, np.pi**-2.0, 0.0)
        self.differences = _DIFFERENCE * self.spread
        others = files - gears
        self.slow = [i for i, scalar in enumerate(free) if scalar in others]
        self.geared = [i for i, scalar in enumerate(free) if scalar in gears]
        trials = experiment.trials
        self.everything = sorted({trial.drive for trial in trials})
        self.drives = sorted({trials[k].drive for k in experiment.fit})
        self.references = sorted({experiment.reference(trials[k].trajectory) for k in experiment.fit})
        self.calibrations = {trial.drive for trial in trials if trial.role == "calibration"}
        self.alike = {trial.drive: experiment.reference(trial.trajectory) for trial in trials}
        self.idle: dict[int, list[int]] = {}
        self.bodies_at: Array | None = None  # where slopes of bodies were taken last

    # what a point costs

    @property
    def rows(self) -> int:
        """Numbers of noise in the trials that are fitted."""
        return sum(self.metric[k].rows for k in self.experiment.fit)

    def predict(self, thetas: Sequence[Array], drives: Sequence[int]) -> list[Predictions]:
        """Predictions of drives at some points, all at once."""
        here = [self.at(theta) for theta in thetas]
        found = iter(self.simulate([(drive, hypothesis) for hypothesis in here for drive in drives]))
        return [{drive: self._shown(theta, drive, next(found)) for drive in drives} for theta in thetas]

    def at(self, theta: Array) -> Hypothesis:
        """The plant with all numbers that are its own."""
        return self.hypothesis.at([self.free[i] for i in self.inside], theta[self.inside])

    def _shown(self, theta: Array, drive: int, plant: Prediction) -> Prediction:
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

    def jacobian(self, k: int, gradients: Gradients) -> Array:
        """(rows, p) of a trial."""
        reference = self.experiment.reference(self.experiment.trials[k].trajectory)
        return self.metric[k](np.moveaxis(gradients[reference].columns, 0, 2))

    def jacobians(self, gradients: Gradients) -> dict[int, Array]:
        """Those of all trials that are fitted."""
        fit = self.experiment.fit
        return dict(zip(fit, side_by_side(lambda k: self.jacobian(k, gradients), fit), strict=True))

    # how it is lowered

    def begin(
        self, theta: Array, gradients: Gradients | None = None, predicted: Predictions | None = None
    ) -> Found:
        """Numbers to begin with, and their slopes; some `gradients` may be of the first numbers alone."""
        predicted = predicted or self.predict([theta], self.everything)[0]
        if gradients is None:
            gradients = self.slopes(theta, {}, ALL)
        elif missing := len(self.free) - len(gradients[self.references[0]].columns):
            wider = {drive: _widened(slope, predicted[drive], missing) for drive, slope in gradients.items()}
            gradients = self.slopes(theta, wider, _OWN)
        found = Found(theta, predicted, gradients)
        self.idle = {drive: self._idle(drive, found.gradients) for drive in self.references}
        return found

    def _idle(self, drive: int, gradients: Gradients) -> list[int]:
        """Numbers that a drive shows nothing of, such as those of joints that it does not turn."""
        length = np.zeros(len(self.free))
        for k in self.experiment.fit:
            if self.experiment.reference(self.experiment.trials[k].trajectory) == drive:
                length += np.sum(self.jacobian(k, gradients) ** 2, axis=0)
        return [int(i) for i in np.flatnonzero(np.sqrt(length) * self.spread < _NEGLIGIBLE)]

    def run(self, found: Found, *, leaps: int) -> Found:
        """Descend; leap to better phases and edges while there are any, at most `leaps` times, and descend again.

        The first leap is made early: what is left out, or a wrong phase, has not yet pulled the others far then. One
        that ends higher than where it left from is taken back.
        """
        left: list[Found] = []
        for number in range(leaps):
            found = self.descend(found, EARLY if number == 0 else _ROUNDS)
            moved = self.leapt(found, smooth=number == 0)
            if moved is not None:
                left.append(found)
                found = moved
            elif number > 0:
                break
        ended = self.descend(found, giving_up=True)
        before = min(left, key=self.height, default=ended)
        if not self.height(ended) > self.height(before):
            return ended
        return min(ended, self.descend(before, giving_up=True), key=self.height)

    def descend(
        self, found: Found, rounds: int = _ROUNDS, *, most: int = ALL, giving_up: bool = False
    ) -> Found:
        """Steps until slopes that are all taken anew promise little, or do not keep what they promise.

        All of them, or only those of suspects' own numbers, as `most` says. When `giving_up`, also until a step does
        little of what is to be done: no number here does it then, and more steps only bend them towards it.
        """
        fresh = found.due if found.due != _OLD else min(GEARS, most)
        idle = 0
        for number in range(found.rounds + 1, found.rounds + rounds + 1):
            found = self.with_slopes(found)
            J = self.jacobians(found.gradients)
            step = self.step(found, J)
            self.settle(information(J), np.abs(step.theta - found.theta))
            little = max(LITTLE, SLIGHT * self.left(found))
            arrived = step.gained < max(little, _STALLED * step.promised)
            kept = step.gained > _AGREED * step.promised
            if step.gained > 0.0:
                gradients = self.updated(found.gradients, found.theta, step)
                found = replace(found, theta=step.theta, predicted=step.predicted, gradients=gradients)
            freshest = min(most, ALL if self._bodies_moved(found.theta) else GEARS)
            # Slopes that promise what they do not keep may have been taken over the wrong differences.
            idle = idle + 1 if arrived and fresh >= freshest else 0
            found = replace(found, rounds=number, converged=idle > 1 or (arrived and step.promised < little))
            if found.converged:
                break
            hope = _HOPE * self.left(found)
            if giving_up and fresh >= freshest and self.gross(found) and step.gained < hope:
                break
            stale = step.gained < max(little, _HALF * step.promised)
            fresh = _OLD if kept else freshest if stale and fresh == GEARS else min(most, GEARS)
            fresh = min(most, ALL) if idle else fresh
            found = replace(found, due=fresh)
        return found

    def leapt(self, found: Found, *, smooth: bool) -> Found | None:
        """Where a stride leads, or else a leap, with slopes; None where neither leads anywhere.

        Where something is missing by far, it makes wrong places as good as right ones.
        """
        found = self.with_slopes(found)
        if not self.gross(found) and (reached := stride(self, found, EARLY, GEARS)):
            return reached
        theta = leap(self, found, smooth=smooth)
        if theta is None:
            return None
        predicted = self.predict([theta], self.everything)[0]
        return Found(theta, predicted, self.slopes(theta, found.gradients), rounds=found.rounds)

    def with_slopes(self, found: Found) -> Found:
        """The same with the slopes that are due."""
        if found.due == _OLD:
            return found
        return replace(found, gradients=self.slopes(found.theta, found.gradients, found.due), due=_OLD)

    def height(self, found: Found) -> float:
        """-2 log posterior, but for a constant."""
        return sum(self.cost(found.theta, found.predicted))

    def left(self, found: Found) -> float:
        """-2 log likelihood beyond that of noise."""
        return self.cost(found.theta, found.predicted)[0] - self.rows

    def gross(self, found: Found) -> bool:
        """Whether so much is left that something is missing, or wrong by far."""
        return self.left(found) > GROSS * self.rows

    def slopes(self, theta: Array, held: Gradients, fresh: int = GEARS) -> Gradients:
        """Slopes at theta; where some are held, only those that `fresh` names are taken again.

        Those of bodies change with the resonances, slowly. Calibrations, slow and at rest for the most part, keep what
        others show better. A law's column is its slope. What is not taken again is as it was taken: a step of drives
        that stick or slip corrects the columns of all that moved with them, and theirs with the wrong ones.
        """
        if fresh == ALL:
            self.bodies_at = theta
        keep = {}
        for drive in self.references:
            same = set(self.idle.get(drive, ())) if drive in held else set()
            if drive in held and fresh < ALL:
                same |= set(self.slow) | (set(self.geared) if fresh == _OWN else set())
                if drive in self.calibrations:
                    same |= {i for i in self.geared if self._shown_beside(i, drive)}
            columns = held[drive].taken.copy() if drive in held else None
            if self.laws:
                if columns is None:
                    grid = self.experiment.drives[drive].n, len(self.experiment.channels)
                    columns = np.zeros((len(self.free), *grid))
                for i, scalar in enumerate(self.free):
                    if scalar.name in self.laws:
                        columns[i] = self.laws[scalar.name][drive]
                        same.add(i)
            if columns is not None:
                keep[drive] = (sorted(same), columns)
        here, free = self.at(theta), self.free
        taken = slopes(
            self.experiment, here, free, self.differences, self.references, self.simulate, keep=keep
        )
        return {drive: replace(one, base=self._shown(theta, drive, one.base)) for drive, one in taken.items()}

    def _bodies_moved(self, theta: Array) -> bool:
        """Whether numbers on which slopes of bodies depend have moved much since these were taken."""
        if self.bodies_at is None:
            return True
        moved = np.abs(theta - self.bodies_at)[self.slow] / self.spread[self.slow]
        return bool((moved > _MUCH).any())

    def room(self, theta: Array) -> tuple[Array, Array]:
        """How far each number may go down and up, in the chart of cosines and sines: these have no bounds."""
        limits = self.polar.flat_parameters
        assert limits.lower is not None and limits.upper is not None
        u = self.polar.flat(theta)
        return np.minimum(limits.lower - u, 0.0), np.maximum(limits.upper - u, 0.0)

    def clipped(self, theta: Array) -> Array:
        """The nearest numbers within bounds."""
        assert self.parameters.lower is not None and self.parameters.upper is not None
        return np.asarray(np.clip(theta, self.parameters.lower, self.parameters.upper), dtype=np.float64)

    def _shown_beside(self, index: int, drive: int) -> bool:
        """Whether a drive other than a calibration shows something of a number."""
        others = set(self.idle) - self.calibrations - {drive}
        return any(index not in self.idle[other] for other in others)

    def updated(self, gradients: Gradients, theta: Array, step: Step) -> Gradients:
        """Broyden's update, lengths in prior sigmas; what laws add is exact."""
        moved = np.zeros(len(theta))
        moved[self.inside] = ((step.theta - theta) / self.spread)[self.inside]
        if not moved.any():
            return {drive: replace(slope, base=step.predicted[drive]) for drive, slope in gradients.items()}
        along = moved / (moved @ moved) / self.spread
        new = {}
        for drive, slope in gradients.items():
            promised = np.tensordot(step.theta - theta, slope.columns, axes=1)
            missed = step.predicted[drive].values - slope.base.values - promised
            columns = slope.columns + along[:, None, None] * missed
            new[drive] = replace(slope, base=step.predicted[drive], columns=columns)
        return new

    def settle(self, H: Array, moved: Array) -> None:
        """Differences that move the whitened residual by about `_SEEN`, and span some of what a step has moved.

        Where friction sticks or slips by a hair, slopes over less than the next step say nothing of it.
        """
        length = np.sqrt(np.maximum(np.diag(H), 1e-300))
        self.differences = np.clip(
            np.maximum(_SEEN / length, _SPAN * moved),
            _LEAST_DIFFERENCE * self.spread,
            _MOST_DIFFERENCE * self.spread,
        )

    def step(self, found: Found, J: Mapping[int, Array]) -> Step:
        """One step in the chart of cosines and sines, as damped and as often corrected as lowers the cost most.

        Numbers that make up for each other (stiffness and inertia, of a resonance) lie along valleys, narrow and bent:
        a step along one is off its bottom by more than it gains, and damping makes it as short as the bend is tight.
        From where a step ends the same equations lead back to the bottom (the chord method).
        Source: J. M. Ortega, W. C. Rheinboldt, Iterative Solution of Nonlinear Equations in Several Variables (1970).
        """
        data, excess = self.cost(found.theta, found.predicted)
        # While much is unexplained, residuals count for less, so that no step is rash.
        weight = 1.0 / max(1.0, data / self.rows)
        ground = Ground(self, found.theta, J, weight)
        points = [ground.minimum(found.theta, found.predicted, damping) for damping in _DAMPING]
        promised = points[0][1]
        best = Step(found.theta, found.predicted, promised, 0.0)
        if promised < GAIN:
            return best
        places = [point for point, _ in points]
        for _ in range(1 + _CHORDS):
            tried = self.predict(places, self.drives)
            costs = [weight * d + e for d, e in self.costs(places, tried)]
            least = int(np.argmin(costs))
            gained = (weight * data + excess - costs[least]) / weight
            if gained > best.gained:
                best = Step(places[least], tried[least], promised, gained)
            if (
                best.gained > _AGREED * promised
                or promised < LITTLE
                or not np.isfinite(costs[:_CHORDED]).all()
            ):
                break
            onward = zip(places[:_CHORDED], tried, _DAMPING, strict=False)
            places = [ground.minimum(place, there, damping)[0] for place, there, damping in onward]
        return best


def _widened(slope: Slopes, base: Prediction, missing: int) -> Slopes:
    """Slopes with room for `missing` more numbers."""
    more = (0, missing), (0, 0), (0, 0)
    return Slopes(base, np.pad(slope.columns, more), np.pad(slope.taken, more))


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
